"""Signals of a machine file that are measured have a channel each: one that stands for two would confirm itself."""

from __future__ import annotations

from collections.abc import Mapping

from replay.errors import ConfigError
from replay.log.source_options import SignalSource

_OF_PARTS = ("wheel.", "steer.")
_MEASURED = {"v", "v_true", "phi", "phi_true"}
_COMMAND_AND_POSITION = {"u", "u_applied"}


def check_own_channels(signals: Mapping[str, SignalSource]) -> None:
    """Raise `ConfigError` where two measured speeds or angles, or a valve's command and its position, are read from one channel.

    Parameters
    ----------
    signals : Mapping[str, SignalSource]
        Where each signal is recorded, by its canonical name.
    """
    seen: dict[tuple[object, ...], str] = {}
    for name, source in signals.items():
        part, _, leaf = name.rpartition(".")
        if not part.startswith(_OF_PARTS) or leaf not in _MEASURED | _COMMAND_AND_POSITION:
            continue
        kind = "measured" if leaf in _MEASURED else part
        place = (kind, source.topic, source.field, source.symbol, source.column, source.source, source.derivative)
        if place in seen:
            raise ConfigError(
                f"[signals] {seen[place]!r} and {name!r} are both read from {source.label}: one channel would confirm itself, or stand for two parts; "
                "give each its own, or leave one of them out"
            )
        seen[place] = name
