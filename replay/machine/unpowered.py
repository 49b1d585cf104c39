"""Wheels without a drive, as a machine file may name them: what it says of them must fit."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from replay.errors import ConfigError
from replay.machine.signal_table import find_signal


def unpowered_of(value: Any) -> tuple[str, ...]:
    """Wheels without a drive, by ``machine.unpowered`` of a machine file.

    Raises
    ------
    ConfigError
        Where it is no list of names.
    """
    if not isinstance(value, list) or not all(isinstance(w, str) for w in value):
        raise ConfigError(
            f'machine.unpowered = {value!r} must be a list of wheels that have no drive, such as ["RR", "RL"]'
        )
    return tuple(dict.fromkeys(value))


def check_unpowered(
    unpowered: Sequence[str], wheels: Sequence[str], part: str, models: Mapping[str, Collection[str]]
) -> None:
    """Raise where `machine.unpowered` names no wheel of the machine, leaves none with a drive, or contradicts a section.

    Parameters
    ----------
    unpowered, wheels : Sequence[str]
        Wheels without a drive, and all of them.
    part : str
        What they are called: ``wheel`` or ``joint``.
    models : Mapping[str, Collection[str]]
        Sections that hold models of drives, with the wheels that each names.

    Raises
    ------
    ConfigError
        In these cases.
    """
    for name in unpowered:
        if name not in wheels:
            raise ConfigError(
                f"machine.unpowered: no {part} {name!r}; machine.wheels has {list(wheels)}, and must name those without a drive, too"
            )
        for section, named in models.items():
            if name in named:
                raise ConfigError(
                    f"[{section}] {name!r} is the model of a drive, and machine.unpowered says that {name} has none"
                )
    if unpowered and set(unpowered) == set(wheels):
        raise ConfigError(
            f"machine.unpowered = {list(unpowered)} leaves no {part} with a drive; name those that only roll along"
        )


_CONTRADICTED = "by machine.unpowered has no drive, and the log has what would be its drive's"


def drive_in_log(found: Mapping[str, str], unpowered: Collection[str]) -> tuple[str, ...]:
    """Sentences on wheels without a drive of which a log has an opening, an effort or a pressure that changes.

    Parameters
    ----------
    found : Mapping[str, str]
        Labels of channels that change and may be signals by their names, by signal.
    unpowered : Collection[str]
        Wheels without a drive.
    """
    of: dict[str, str] = {}
    for name, label in found.items():
        if is_of_no_drive(name, unpowered):
            of.setdefault(name.split(".")[1], label)
    return tuple(f"{wheel} {_CONTRADICTED} ({label}): correct the machine file" for wheel, label in of.items())


def is_contradicted(note: str) -> bool:
    """Whether a note is one of `drive_in_log`."""
    return _CONTRADICTED in note


def is_of_no_drive(name: str, unpowered: Collection[str]) -> bool:
    """Whether a signal is of the drive of a wheel that has none."""
    entry = find_signal(name)
    return entry is not None and entry.of_drive and name.split(".")[1] in unpowered


def check_name(section: str, name: str, unpowered: Collection[str]) -> None:
    """Raise `ConfigError` where a signal is of the drive of a wheel that has none."""
    if is_of_no_drive(name, unpowered):
        raise ConfigError(
            f"[{section}] {name!r} is of a drive, and machine.unpowered says that {name.split('.')[1]} has none: leave out one of the two"
        )
