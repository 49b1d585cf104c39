"""Evidence where a quantity is measured twice."""
