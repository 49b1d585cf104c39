"""A diagnosis as ROS messages, to lie beside its log in viewers."""
