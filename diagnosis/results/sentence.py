"""Sentences of a finding's evidence that say what they are of: who joins or restates findings keeps, drops or renews them by that."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import StrEnum


class About(StrEnum):
    """What a sentence gives."""

    #: How far a channel deviates, beside its threshold.
    DEVIATION = "deviation"
    #: How much more probable the fault is than none, by the family's own models.
    TIMES = "times"
    #: In how many of 100 cases such a fault was this one; the number is the part in the middle.
    CASES = "cases"
    #: The share that a channel was of its reference; its bounds are the part in the middle.
    SHARE = "share"
    #: The saturation term.
    SAT = "sat"
    #: What the shape of a fault's onset says of the side.
    ONSET = "onset"
    #: The next best explanation, and its probability.
    RIVAL = "rival"
    #: By how many milliseconds a channel comes late; they are the part in the middle.
    LATE = "late"
    #: That one spell is of one row as probably as of another.
    EITHER = "either"
    #: What several spells have in common.
    SPELLS = "spells"
    #: The effort by which a drive was judged.
    EFFORT = "effort"


class Sentence(str):
    """A sentence as text, with what it is about and a part in the middle that may be stated anew.

    Attributes
    ----------
    about : About
        What it gives.
    parts : tuple[str, str, str]
        Text before that part, the part, and the text behind it; the last two may be empty.
    """

    __slots__ = ("about", "parts")
    about: About
    parts: tuple[str, str, str]

    def __new__(cls, about: About, before: str, part: str = "", behind: str = "") -> Sentence:
        """Text and what it is about."""
        made = super().__new__(cls, before + part + behind)
        made.about, made.parts = about, (before, part, behind)
        return made

    def __getnewargs__(self) -> tuple[About, str, str, str]:  # type: ignore[override]
        """What a copy is made of."""
        return (self.about, *self.parts)

    def mapped(self, change: Callable[[str], str]) -> Sentence:
        """The same with each of its parts changed, such as by words that are filled in."""
        return Sentence(self.about, *map(change, self.parts))

    def stated_anew(self, part: str) -> Sentence:
        """The same with another part in the middle."""
        return Sentence(self.about, self.parts[0], part, self.parts[2])


def lasting(seconds: float, digits: int) -> str:
    """How long a channel did something, in a sentence on it: braces tell where the end says how that goes with how long its fault lasts.

    See `diagnosis.decision.lengths`. Written with so many `digits` behind the point.
    """
    return f"{{{seconds:.{digits}f} s}}"


def is_about(text: str, *about: About) -> bool:
    """Whether a sentence says that it gives one of some things."""
    return isinstance(text, Sentence) and text.about in about


def about_of(texts: Iterable[str]) -> list[str]:
    """What each of some sentences is about, as text; empty where it does not say."""
    return [text.about.value if isinstance(text, Sentence) else "" for text in texts]


def mapped(text: str, change: Callable[[str], str]) -> str:
    """A sentence changed, which still says what it is about if it did."""
    return text.mapped(change) if isinstance(text, Sentence) else change(text)


def stated_anew(text: str, about: About, part: str) -> str:
    """A sentence with another part in the middle if it is about that, else as it is."""
    return text.stated_anew(part) if isinstance(text, Sentence) and text.about is about else text
