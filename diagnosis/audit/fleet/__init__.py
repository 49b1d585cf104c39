"""The fleet's document and table."""
