"""Wheels in a log that may have no drive: their speeds are there, and what drives the others is not there of them."""

from __future__ import annotations

from collections.abc import Collection

from replay.machine.signal_table import find_signal
from replay.setup.draft_notes import Draft


def ask_about_drives(draft: Draft, found: Collection[str]) -> None:
    """Ask whether wheels only roll along of which the log has a speed, and no opening, effort or pressure as of the others.

    The line that says so stands as a comment in the machine file: taken for granted, a drive that is merely not logged would be cleared.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    found : Collection[str]
        Names of the signals that were found.
    """
    driven = {n.split(".")[1] for n in found if (e := find_signal(n)) is not None and e.of_drive}
    free = [w for w in draft.machine.wheels if w not in driven and {f"wheel.{w}.v", f"wheel.{w}.v_true"} & set(found)]
    if not driven & set(draft.machine.wheels) or not free:
        return
    many = len(free) > 1
    names = f"{', '.join(free[:-1])} and {free[-1]}" if many else free[0]
    draft.unpowered = tuple(free)
    draft.ask(
        "machine",
        f"{'have' if many else 'has'} {names} no drive? The log has {'their speeds' if many else 'its speed'} alone, and of other wheels what "
        f"drives them, too. If {'they only roll' if many else 'it only rolls'} along, take the # from the line unpowered; else name the "
        f"{'signals of their drives' if many else 'signal of its drive'}, or {'they are' if many else 'it is'} not judged.",
    )
