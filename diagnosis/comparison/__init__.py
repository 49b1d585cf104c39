"""Two missions of one machine: new, worse, changed and resolved faults."""
