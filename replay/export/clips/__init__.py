"""Clips of a log for other viewers."""
