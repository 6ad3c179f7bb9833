"""A gateway as a node of the ROS graph, for ROS 2 nodes on rmw_zenoh."""

from sdrlinkd.fleet.ros.side import FromRos, RosSide
from sdrlinkd.fleet.ros.topics import About

__all__ = ["About", "FromRos", "RosSide"]
