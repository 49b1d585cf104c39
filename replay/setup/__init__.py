"""A first machine file from a log: what its wheels are called, where they are, and where their signals stand."""
