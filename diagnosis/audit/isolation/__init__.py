"""Each mission in a process of its own, within limits."""
