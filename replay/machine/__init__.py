"""The machine: configuration, TOML file, geometry, units."""
