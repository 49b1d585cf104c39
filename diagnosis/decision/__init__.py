"""Verdict, severity, caveats, data quality, what is missing."""
