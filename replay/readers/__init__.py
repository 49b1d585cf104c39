"""One reader per container format; `registry` picks the one that fits a path."""
