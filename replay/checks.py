"""Checks of values that a user has given."""

from __future__ import annotations

from replay.errors import ConfigError


def check_range(key: str, value: float, low: float, high: float, unit: str) -> None:
    """Raise a `ConfigError` that names the key, the value, the unit and the range."""
    if not low <= value <= high:
        raise ConfigError(f"{key} = {value:g} {unit} is out of range; expected {low:g} to {high:g} {unit}")
