"""Several files of one mission on one clock."""
