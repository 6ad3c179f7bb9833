"""ROS 2 over sdrlinkd: topics of this robot appear at the others, and theirs appear here.

Needs rclpy and the client of sdrlinkd; runs on Python 3.10 and newer.
"""
