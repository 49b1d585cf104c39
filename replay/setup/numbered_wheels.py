"""Wheels that a log tells by numbers alone: their sides from how they answer turns, and what stays to be asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion
from replay.setup.structure import Structure
from replay.signals.like_wheels import WHICH
from replay.signals.name_parts import position

_NAMED = 8  # channels in a question
_LEAST = 0.03  # m from the middle, from which a side is told


def ordered_by_turns(structure: Structure, motions: Mapping[str, WheelMotion]) -> Structure | None:
    """The structure with its wheels in the order of the numbers, as far as turns tell it; None where they change nothing.

    Each side's wheels stay in the order of their numbers, the first in front: only left and right show in turns.

    Parameters
    ----------
    structure : Structure
        Its wheels in the order that was supposed.
    motions : Mapping[str, WheelMotion]
        By canonical name, of the wheels' speeds.
    """
    if structure.places is None:
        return None
    sides = []
    for wheel in structure.wheels:
        motion = motions.get(f"wheel.{wheel}.v_ref") or motions.get(f"wheel.{wheel}.v")  # no fault hides what is asked
        if motion is None or motion.y is None or abs(motion.y) < _LEAST:
            return None
        sides.append(motion.y > 0)
    rows = {"front": 0, "middle": 1, None: 1, "rear": 2}
    ahead = sorted(structure.wheels, key=lambda w: rows[position(w)[0]])
    names = {left: [w for w in ahead if (structure.places[w].y > 0) == left] for left in (True, False)}
    if any(len(names[left]) != sides.count(left) for left in (True, False)):
        return None
    order = tuple(names[left].pop(0) for left in sides)
    if order == structure.wheels:
        return None
    return replace(structure, wheels=order, places={w: structure.places[w] for w in order})


def ask_for_numbers(draft: Draft, numbered: list[str], by_turns: bool) -> None:
    """Ask which wheel is which, where signals have only a number.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    numbered : list[str]
        What each number was taken for; empty: nothing is asked.
    by_turns : bool
        Whether turns have told left and right.
    """
    if not numbered:
        return
    told = (
        "left and right follow from the turns of this log, front and rear are supposed"
        if by_turns
        else "no name says it"
    )
    draft.ask(
        "machine",
        f"which wheel has which number? {', '.join(numbered)}: {told}; a wrong order blames the wrong wheel. Put the wheels into "
        "their order, or change the lines below.",
    )


def ask_for_more_wheels(draft: Draft, names: Sequence[str]) -> None:
    """Ask for wheels whose speeds are in the log, and which the draft does not have.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    names : Sequence[str]
        Channels that are called like a wheel's speed; empty: nothing is asked.
    """
    if not names:
        return
    own = draft.machine.wheels
    many = len(names) > 1
    draft.ask(
        "machine",
        f"{WHICH[many]}{', '.join(names[:_NAMED])}{', …' if len(names) > _NAMED else ''}? {'They are' if many else 'It is'} called like a speed of {', '.join(own)}, and "
        f"{'are' if many else 'is'} of none of these: {'they were' if many else 'it was'} left out, and nothing clears a machine with wheels "
        "that nobody judged. Give each a name in wheels, a place in [geometry], and lines in [signals] like those below; "
        f"delete this question if {'they are' if many else 'it is'} no wheel{'s' if many else ''}.",
    )
