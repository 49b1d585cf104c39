"""How to speak of a machine, as rows of the documents; `diagnosis.results.machine_words` makes words of it."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict


class WordsRow(TypedDict):
    """How to speak of a machine: what moves its parts, what they are, and the unit of their speeds."""

    drive: Literal["valve", "motor", "drive"]
    part: Literal["wheel", "joint"]
    speed_unit: str


class Worded(TypedDict):
    """What says how to speak of a machine: `words`, absent in results of older versions, which spoke of wheels and valves."""

    words: NotRequired[WordsRow]
