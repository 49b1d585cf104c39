"""The `mfhca` command line."""
