"""Whether a mission clears a machine: what its signals leave open, asked of them once more and without a model of any fault."""
