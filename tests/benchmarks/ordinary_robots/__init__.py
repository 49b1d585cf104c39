"""Ordinary velocity-controlled robots that share nothing with the project's simulator: machines, drives, faults, logs."""
