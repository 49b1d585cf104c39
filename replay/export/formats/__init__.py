"""Writers, one per container format."""
