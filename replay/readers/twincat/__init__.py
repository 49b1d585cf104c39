"""Beckhoff TwinCAT Scope exports: text and `.svdx`."""
