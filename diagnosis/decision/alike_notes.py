"""Notes that say the same of many signals, as one: a recorder whose clock runs backwards does so in every channel."""

from __future__ import annotations

import re
from collections.abc import Iterable

_OF_SIGNAL = re.compile(r"((?:cmd|wheel|steer|imu|gnss|odom)\.[\w.]+): (.*)", re.DOTALL)
# a number by itself, and none of a name as *v1* or *aWheel[1]*
_NUMBER = re.compile(r"(?<![\w.\[])(?:once|\d+(?:\.\d+)?(?: times)?)(?![\w\]]|\.\w)")
_MANY, _NAMED = 4, 3  # signals of which one thing is told together, and named of them


def alike_notes(texts: Iterable[str]) -> list[str]:
    """Notes, each once; those that differ in their signal and their numbers alone as one, at the place of the first.

    Parameters
    ----------
    texts : Iterable[str]
        Sentences; of a signal as ``wheel.FR.v: …``.
    """
    every = list(dict.fromkeys(texts))
    groups: dict[str, list[tuple[str, str]]] = {}
    for text in every:
        key, signal, said = _parts(text)
        if signal:
            groups.setdefault(key, []).append((signal, said))
    out, told = [], set[str]()
    for text in every:
        key, signal, _ = _parts(text)
        if not signal or len(groups[key]) < _MANY:
            out.append(text)
        elif key not in told:
            told.add(key)
            out.append(_together(groups[key]))
    return out


def _parts(text: str) -> tuple[str, str, str]:
    """What a note says without its numbers, its signal, and what it says; the signal is empty where it has none."""
    found = _OF_SIGNAL.fullmatch(text)
    if found is None:
        return text, "", text
    return _NUMBER.sub("#", found[2]), found[1], found[2]


def _together(notes: list[tuple[str, str]]) -> str:
    """One note on several signals, with the range of every number."""
    first = notes[0][1]
    numbers = [[_value(x) for x in _NUMBER.findall(said)] for _, said in notes]
    ranges = iter([(min(column), max(column)) for column in zip(*numbers, strict=True)])

    def spanned(found: re.Match[str]) -> str:
        low, high = next(ranges)
        times = " times" if found[0] == "once" or found[0].endswith(" times") else ""
        return found[0] if low == high else f"{low:g} to {high:g}{times}"

    named = ", ".join(signal for signal, _ in notes[:_NAMED])
    return f"{len(notes)} signals ({named}, …): {_NUMBER.sub(spanned, first)}"


def _value(number: str) -> float:
    return 1.0 if number == "once" else float(number.removesuffix(" times"))
