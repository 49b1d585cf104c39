"""Each fault as a log of its own."""
