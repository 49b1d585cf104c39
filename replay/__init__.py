"""From a recorded log to signals on one time axis and the replayed MFHCA loop."""
