"""Messages to columns: CDR, ROS 1, protobuf, JSON."""
