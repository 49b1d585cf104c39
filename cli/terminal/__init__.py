"""Streams, progress, interrupts and options that all commands share."""
