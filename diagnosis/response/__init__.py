"""Drives whose speed alone is logged beside its command: judged by their response, by each other, and by their channels."""
