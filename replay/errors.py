"""Errors that a user can act on; anything else is a bug.

    MfhcaError
    ├── ConfigError      exit 2   usage, options or the machine file
    │   └── OutputError  exit 2   a result cannot be written
    └── LogError         exit 3   a log cannot be read
        └── NotJudged    exit 3   a readable log in which nothing can be judged

A message is one sentence or two: the file and the place in it, what was found, what was expected,
and what to do.
"""

from __future__ import annotations

from collections.abc import Sequence


class MfhcaError(Exception):
    """Base of every error that the command line prints as one line."""

    exit_code = 70


class ConfigError(MfhcaError):
    """The command's words or the machine file are off."""

    exit_code = 2


class OutputError(ConfigError):
    """A result cannot be written where it was asked for."""


class LogError(MfhcaError):
    """A log, or one place in it, cannot be read."""

    exit_code = 3


class NoLog(LogError):
    """A table that is no machine's log: nothing of a machine is missing with it."""


class NotJudged(LogError):
    """The log is readable, but it holds nothing from which a fault could be judged."""


def check_range(
    key: str, value: float, low: float, high: float, unit: str, *, mistaken: Sequence[tuple[str, float]] = ()
) -> None:
    """Raise a `ConfigError` that names the key, the value, the unit and the range.

    Parameters
    ----------
    key : str
        Section and key.
    value, low, high : float
        What was given, and its range.
    unit : str
        Unit of all three.
    mistaken : Sequence[tuple[str, float]]
        Units that the value may have been given in by mistake, each with its factor to `unit`: where converted values lie
        in the range, the message says what to write.
    """
    if low <= value <= high:
        return
    hint = ""
    fitting = [(words, value * factor) for words, factor in mistaken if low <= value * factor <= high]
    if fitting:
        name, _, last = key.rpartition(".")
        hint = f"; {value:g} looks like {' or '.join(words for words, _ in fitting)}: write {last} = "
        hint += " or ".join(f"{converted:.5g}" for _, converted in fitting) + (f" in [{name}]" if name else "")
    raise ConfigError(f"{key} = {value:g} {unit} is out of range; expected {low:g} to {high:g} {unit}{hint}")
