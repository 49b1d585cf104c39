"""What a log holds: topics, rates, gaps, clocks."""
