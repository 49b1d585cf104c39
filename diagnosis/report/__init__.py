"""The HTML mission report, built from a saved result."""
