"""Evidence from the model of a steering axle: valve command to angle."""
