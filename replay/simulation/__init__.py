"""A closed-loop machine with known faults: wheels, body, terrain, sensors and the MFHCA loop."""
