"""What the command line and `import mfhca` share: from plain values to results, and results as tables and figures."""
