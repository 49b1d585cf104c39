"""Fault estimation, decision, metrics and reports on a replayed mission."""
