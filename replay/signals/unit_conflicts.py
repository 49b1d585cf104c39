"""Channels whose own names state another unit than the machine file reads them in: all wheels in km/h show in no comparison of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from replay.log.source_options import SignalSource
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.signals.named_units import bare_name

_TOLD = 2  # channels that are named


def unit_conflict(sources: Mapping[str, SignalSource] | Iterable[tuple[str, SignalSource]]) -> str:
    """A sentence, without its stop, on channels whose names state one unit in brackets and whose sources another of the same quantity.

    Empty where none does. A gain makes any unit of another.

    Parameters
    ----------
    sources : Mapping[str, SignalSource] or Iterable[tuple[str, SignalSource]]
        Where signals are recorded, by their canonical names.
    """
    pairs = sources.items() if isinstance(sources, Mapping) else sources
    found = [(name, source, unit) for name, source in pairs if (unit := _other_unit(source))]
    if not found:
        return ""
    named = ", ".join(f"{source.label} ({name}) in {source.unit}" for name, source, _ in found[:_TOLD])
    more = f" and {len(found) - _TOLD} more channels likewise" if len(found) > _TOLD else ""
    return (
        f"the machine file reads {named}{more}, while their names say {', '.join(dict.fromkeys(u for *_, u in found))}"
    )


def _other_unit(source: SignalSource) -> str:
    """Unit that a channel's name has in brackets where it is of the same quantity as the one given, and of another size; else empty."""
    stated, given = known_unit(bare_name(source.label)[1]), known_unit(source.unit or "")
    if stated is None or given is None or source.gain != 1.0:
        return ""
    (one, factor), (other, by) = UNITS[stated], UNITS[given]
    return stated if one == other and factor != by else ""
