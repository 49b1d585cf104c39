"""Steering in a log whose wheels are all fixed in the draft: asked for, rather than left out without a word."""

from __future__ import annotations

from collections.abc import Collection

from replay.setup.draft_notes import Draft
from replay.setup.structure import Structure

_NAMED = 2


def ask_about_steering(structure: Structure, names: Collection[str], draft: Draft) -> None:
    """Ask whether the machine steers where names of its log speak of steering, and none of its wheels is steered.

    Parameters
    ----------
    structure : Structure
        Of the machine.
    names : Collection[str]
        Channels and joints that speak of steering.
    draft : Draft
        Takes the question.
    """
    if not names or any(p.axle != "fixed" for p in (structure.places or {}).values()):
        return
    first = sorted(names)
    more = f" and {len(first) - _NAMED} more" if len(first) > _NAMED else ""
    draft.ask(
        "geometry",
        f"does it steer, as {', '.join(first[:_NAMED])}{more} in the log say, with nothing of it judged as it is here? None of the wheels "
        "that have speeds is steered; `mfhca config init --preset ackermann` writes a car's four wheels, of which the front ones steer.",
    )
