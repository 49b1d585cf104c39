"""Signals without a unit whose values cannot be SI: the unit that they usually have then, asked in one question for each kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from replay.log.source_options import SignalSource
from replay.machine.signal_table import quantity_of
from replay.setup.draft_notes import Draft
from replay.signals.signal import Signals
from replay.signals.to_si import peak_of

#: By quantity: the unit, from and up to which largest value it is taken, and what the values would be in SI.
_USUAL = {
    "fraction": ("%", 1.5, 150.0, "fractions of full opening"),
    "angle": ("deg", 3.2, 180.0, "radians"),
    "rotation": ("deg/s", 6.3, 400.0, "rad/s"),
}


def usual_units(draft: Draft, found: Signals) -> Mapping[str, SignalSource]:
    """Sources of the signals that get a unit, by canonical name; the draft takes the questions.

    Parameters
    ----------
    draft : Draft
        Takes one question for each kind.
    found : Signals
        As found by their names, SI where no unit is stated.
    """
    out: dict[str, SignalSource] = {}
    for quantity, (unit, least, most, si) in _USUAL.items():
        bare = {
            n: s
            for n, s in found.items.items()
            if quantity_of(n) == quantity and not s.origin.unit and not n.endswith(".psi") and not n.startswith("odom")
        }
        peak = max((peak_of(s.values) for s in bare.values()), default=0.0)
        if not least < peak <= most:
            continue
        out |= {n: replace(s.origin, unit=unit) for n, s in bare.items()}
        named = ", ".join(s.origin.label for s in bare.values())
        draft.ask("signals", f"are {named} in {unit}? None is stated; in {si} they would reach {peak:.3g}.")
    return out
