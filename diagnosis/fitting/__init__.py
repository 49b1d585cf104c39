"""A machine's constants from healthy missions."""
