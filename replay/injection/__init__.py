"""Known faults written into a recorded log."""
