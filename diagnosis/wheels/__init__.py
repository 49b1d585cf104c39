"""Evidence from the model of a wheel: valve command to speed."""
