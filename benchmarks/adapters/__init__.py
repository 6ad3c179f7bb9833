"""What adapters cost: the ROS 2 bridge beside a plain one, on the same daemon."""
