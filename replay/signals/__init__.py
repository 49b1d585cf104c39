"""From names and fields to channels in SI units on one time axis."""
