"""What a stretch of time looks like: the features by which the rows of the tables are told apart."""
