"""Writers: one mission in every format that the readers know."""
