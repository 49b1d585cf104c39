"""Which missions there are, and whose."""
