"""Messages that tell where a robot is."""

from math import cos, sin

from sdrlinkd.adapters import empty, to_cdr

ODOMETRY = "nav_msgs/msg/Odometry"


def odometry(x, y, heading=0.0):
    message = empty(ODOMETRY)
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    at.x, at.y, turn.z, turn.w = x, y, sin(heading / 2), cos(heading / 2)
    return to_cdr(message, ODOMETRY)
