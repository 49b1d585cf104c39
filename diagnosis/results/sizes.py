"""Sizes in the sentences of an assessment: amounts with their unit, and how much more probable a fault makes a channel."""

from __future__ import annotations

import math

from diagnosis.results.plain_numbers import plain
from replay.machine.quantities import OPENING

_MOST, _LEAST, _LESS = 1e6, 1.5, "less probable"
_WIDEST = 0.95  # 95 % bounds of a loss that are as wide say nothing of it


def loss_known(low: float, high: float) -> bool:
    """Whether 95 % bounds of a loss [1] leave something known of it, so that a sentence may give its size."""
    return high - low < _WIDEST


def gain_words(epsilon: float) -> str:
    """What a part gives whose loss [1] no row of the tables describes, ``1.91 times what it should be``; empty for a loss that one does."""
    return "" if 0.0 <= epsilon <= 1.0 else f"{plain(1.0 - epsilon, 3)} times what it should be"


def amount(value: float, unit: str, digits: int = 3) -> str:
    """A value with its unit, for `MachineWords.fill`: ``0.31 {speed_unit}``, of a command ``2.1{percent}``, an angle or a turn in degrees.

    Parameters
    ----------
    value : float
        The value, in `unit`.
    unit : str
        As recorded: m/s, rad, rad/s of a machine or an axle that turns, a fraction of full opening.
    digits : int
        Significant digits.
    """
    if unit == OPENING:
        return f"{plain(100 * value, digits)}{{percent}}"
    if unit == "rad":
        return f"{plain(math.degrees(value), digits)}°"
    if unit == "rad/s":
        return turn(value, digits)
    return f"{plain(value, digits)} {'{speed_unit}' if unit == 'm/s' else unit}".rstrip()


def turn(value: float, digits: int = 2, sign: str = "") -> str:
    """How fast something turns in words, ``5.7°/s``, as the page shows it.

    `value` in rad/s; `sign` ``+``: with its sign always.
    """
    words = plain(math.degrees(value), digits)
    return f"{sign if value > 0.0 else ''}{words}°/s"


def kept_to(least: float, most: float, unit: str) -> str:
    """That a channel hardly moved, to follow its name: ``stayed between 0.312 and 0.315 m/s``, ``stayed at 4.2°``.

    Least and largest value in `unit`, see `amount`.
    """
    words = [amount(0.0 if abs(x) < 1e-3 * (most - least) else x, unit, _digits(least, most)) for x in (least, most)]
    if words[0] == words[1]:
        return f"stayed at {words[0]}"
    first = words[0].removesuffix("°").partition("{")[0].partition(" ")[0]
    return f"stayed between {first} and {words[1]}"


def _digits(least: float, most: float) -> int:
    """Digits that tell two values apart, three to six."""
    apart, size = most - least, max(abs(least), abs(most))
    return 3 if apart <= 0 or size <= 0 else min(6, max(3, 1 + math.ceil(math.log10(size / apart))))


def not_reported(below: int, name: str) -> str:
    """Sentence on deviations of a channel that are too small to count."""
    many = f"{below} deviations of {name} are" if below != 1 else f"1 deviation of {name} is"
    return f"{many} below the limits from which a deviation counts as a fault, and not reported."


def probable_words(log_evidence: float, this: str = "with this fault", other: str = "without one") -> str:
    """How probable a channel is, to follow *is*: ``about 3 000 times as probable with this fault as without one``.

    A difference of natural logarithms [1].
    """
    words = times_as_probable(log_evidence)
    return f"{words} {this} {'than' if words == _LESS else 'as'} {other}"


def times_as_probable(log_evidence: float) -> str:
    """A log-evidence in words, to be followed by *with this fault as without*: ``about 3 000 times as probable``.

    A difference of natural logarithms [1].
    """
    if log_evidence > math.log(_MOST):
        return "more than a million times as probable"
    times = math.exp(log_evidence)
    if times < _LEAST:
        return "about as probable" if times > 1.0 / _LEAST else _LESS
    rounded = float(f"{times:.1g}") if times >= 10.0 else float(f"{times:.2g}")
    return (
        f"about {rounded:,.0f}".replace(",", "\u202f") + " times as probable"
        if times >= 10.0
        else f"{rounded:g} times as probable"
    )
