"""ROS 2 programs of the benchmark `adapters`: a plain bridge, and nodes that load one."""
