"""Columns longer than memory: blocks, envelopes, missing values."""
