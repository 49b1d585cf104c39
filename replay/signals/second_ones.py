"""Which of several channels of one part and quantity is the first measurement, and which the second, by numbers in their names.

``/wheel_FL/speed`` beside ``/wheel_FL/speed2``, ``/steer_FR/state`` with a field ``angle`` beside ``/steer_FR/angle2``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import pairwise

from replay.signals.candidate import Candidate
from replay.signals.name_parts import is_place
from replay.signals.name_words import tokens

_QUANTITIES = frozenset(
    ("speed", "velocity", "vel", "rpm", "angle", "phi", "position", "pos", "encoder", "enc", "sensor", "act", "actual",
     *("measured", "meas", "feedback", "fb", "resolver", "winkel", "drehzahl", "geschwindigkeit", "ist")),
)  # fmt: skip
_AGAIN = frozenset(("redundant", "second", "secondary", "backup", "zweiter", "zweite"))
_BY_NAME = 8  # rank of a part that its name says, by no number
_PART = re.compile(r"[./\s]+")


def number_of(label: str) -> int:
    """Number that follows a word of a quantity in a name: 2 of ``/wheel_FL/speed2.speed``; 0 where there is none, 2 for ``redundant``.

    A number that follows a place or another word counts parts, not measurements.
    """
    best = 0
    for part in filter(None, _PART.split(label)):
        words = tokens(part)
        best = max(best, 2 if _AGAIN & {*words} else 0)
        for word, after in pairwise(words):
            if word in _QUANTITIES and not is_place(word) and after.isdigit() and len(after) < 3:
                best = max(best, int(after))
    return best


def seconds(found: Iterable[Candidate]) -> Mapping[str, tuple[Candidate, Candidate]]:
    """First and second measurement of each speed and angle that two channels or more measure by their names.

    Parameters
    ----------
    found : Iterable[Candidate]
        Of one log.

    Returns
    -------
    Mapping[str, tuple[Candidate, Candidate]]
        By the name of the first one's signal; only where their numbers tell the two apart, and no name is of a second one by itself.
    """
    every = [*found]
    named = {c.signal for c in every}
    groups: dict[str, dict[str, Candidate]] = {}
    for one in every:
        if one.rank == _BY_NAME and re.fullmatch(r"wheel\..*\.v|steer\..*\.phi", one.signal):
            groups.setdefault(one.signal, {}).setdefault(one.origin.label, one)
    out = {}
    for signal, some in groups.items():
        ranked = sorted(some.values(), key=lambda c: number_of(c.origin.label))
        numbers = [number_of(c.origin.label) for c in ranked]
        if (
            len(ranked) > 1
            and f"{signal}_true" not in named
            and numbers[0] < numbers[1]
            and numbers.count(numbers[1]) == 1
        ):
            out[signal] = ranked[0], ranked[1]
    return out
