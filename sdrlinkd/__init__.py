"""sdrlinkd: ROS 2 messages between robots over software radio, without IP."""

__version__ = "0.1.0"
