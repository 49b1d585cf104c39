"""A satellite receiver that shows that a machine went as it was told, where the speeds of its drives say that it did not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.body import BodySpeed
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.pulses import in_pulses
from diagnosis.results.plain_numbers import plain
from diagnosis.results.said import Said, Stated
from replay.machine.config import Limits

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_AROUND_S = 3.0  # over which way is compared: receivers are late, and machines take a while
_NEAR = 0.35  # of what is asked, that the way over ground may differ from it
_ASKED = 2.0  # driving speeds
_MOSTLY = 0.5  # of a time
_OTHERWISE = 0.6  # of the usual speed over ground, that all speeds usually read, or it of theirs: they contradict it
_LEAST_S = 2.0


class Witness(NamedTuple):
    """Where a receiver shows the machine going as it is told.

    Attributes
    ----------
    name : str
        The receiver, in words; empty where there is none.
    there : Flags, shape (b,)
        Blocks in which it does.
    mostly : bool
        Whether it does so in most of the mission in which the machine is told to go.
    """

    name: str
    there: Flags
    mostly: bool = False

    def saw(self, start: int, stop: int, width: int) -> bool:
        """Whether it does so in most of the steps [start, stop); `width` is the number of steps in a block."""
        part = self.there[start // width : -(-stop // width)]
        return bool(part.size and np.mean(part) > _MOSTLY)


def witness_of(
    speeds: Sequence[BodySpeed], drives: Sequence[FollowerData], width: int, limits: Limits, dt: float
) -> Witness:
    """Where the way over ground is what all drives together are asked for.

    Odometry does not count: it may be made of the speeds in question, or of the commands.

    Parameters
    ----------
    speeds : Sequence[BodySpeed]
        The body's speed by its own sensors, in blocks.
    drives : Sequence[FollowerData]
        All drives.
    width : int
        Steps of a block.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    asked = np.abs(np.mean([np.nan_to_num(cells(d.asked, width)) for d in drives], axis=0))
    number = max(1, round(_AROUND_S / (width * dt)))
    for body in speeds:
        if body.name == "odometry":
            continue
        told, went, known = (
            np.convolve(x, np.ones(number) / number, mode="same")
            for x in (asked, np.nan_to_num(np.abs(body.speed)), np.isfinite(body.speed).astype(np.float64))
        )
        went = went / np.maximum(known, 1e-9)
        goes = told > _ASKED * limits.driving_speed
        there = goes & (known > _MOSTLY) & (np.abs(went - told) < _NEAR * told)
        if there.any():
            return Witness(body.name, np.asarray(there), bool(np.mean(there[goes]) > _MOSTLY))
    return Witness("", np.zeros(asked.size, np.bool_))


def contradicted(speeds: Sequence[BodySpeed], drives: Sequence[FollowerData], width: int, limits: Limits) -> str:
    """A sentence where a receiver shows the machine going, at another speed than all of its drives read; empty where none does.

    It need not go as fast as it is told: also where a limit keeps it slower, medians that contradict the way over ground say nothing of
    how it followed. Arguments as for `witness_of`.
    """
    asked = np.abs(np.mean([np.nan_to_num(cells(d.asked, width)) for d in drives], axis=0))
    for body in speeds:
        if body.name == "odometry":
            continue
        use = (asked > _ASKED * limits.driving_speed) & np.isfinite(body.speed)
        if not use.any() or np.mean(use[asked > _ASKED * limits.driving_speed]) < _MOSTLY:
            continue
        went = float(np.median(np.abs(body.speed[use])))
        steps = np.repeat(use, width)
        readings = [np.abs(d.y[: steps.size][steps[: d.y.size]]) for d in drives]
        if not all(np.isfinite(y).any() for y in readings):
            continue
        read = [float(np.nanmedian(y)) for y in readings]
        if went > _ASKED * limits.driving_speed and (max(read) < _OTHERWISE * went or min(read) > went / _OTHERWISE):
            names = " and ".join(d.name for d in drives)
            return (
                f"By the {body.name} the machine went at {plain(went, 2)} {{speed_unit}} while it was commanded, and {names} read "
                f"{plain(np.median(read), 2)} {{speed_unit}} (medians): readings that come in pulses, a wrong unit, a channel of something else, or "
                "readings that are wrong; how the machine followed its commands they do not tell."
            )
    return ""


def denied(
    witness: Witness, idle: Sequence[tuple[int, int]], drives: Sequence[FollowerData], unread: Sequence[str], dt: float
) -> tuple[Said, ...]:
    """What is said where a receiver shows that it is the speeds which are wrong together, not the machine.

    Parameters
    ----------
    witness : Witness
        The receiver.
    idle : Sequence[tuple[int, int]]
        Steps [start, stop) in which all speeds stand still although the drives are commanded, and it shows motion.
    drives : Sequence[FollowerData]
        All drives.
    unread : Sequence[str]
        What would be said of drives of which no answer to any command was found.
    dt : float
        Step [s].
    """
    names = " and ".join(d.name for d in drives)
    if unread:
        text = (
            f"The {witness.name} shows that the machine went as it was told; nothing relates that to {names}: a wrong unit, a channel of something "
            "else, or readings that are wrong together."
        )
        return (Said(text),)
    total = sum(b - a for a, b in idle) * dt
    if total < _LEAST_S:
        return ()
    start, stop = max(idle, key=lambda s: s[1] - s[0])
    longest = Stated.of(start * dt, stop * dt)
    text = (
        f"For {total:.1f} s {names} stood still together (longest {longest}), while the {witness.name} shows that the "
        "machine went as it was told: what they have in common failed, such as their supply, a controller or a driver; no {wheel} is blamed for it."
    )
    return (Said(text, (longest.span,)),)


def witnessed(
    ignored: Sequence[str],
    witness: Witness,
    idle: Sequence[tuple[int, int]],
    drives: Sequence[FollowerData],
    speeds: Sequence[BodySpeed],
    steps: tuple[int, Limits, float],
) -> tuple[tuple[str, ...], tuple[Said, ...]]:
    """What stays of *did not follow its commands*, a sentence, and what is said of speeds that do not show it.

    Parameters
    ----------
    ignored : Sequence[str]
        What would be said of drives of which no answer to any command was found, judged or not.
    witness, idle, drives, speeds
        As for `denied` and `witness_of`.
    steps : tuple[int, Limits, float]
        Steps of a block, ``driving_speed``, step [s].
    """
    width, limits, dt = steps
    if ignored and (pulses := in_pulses(drives)):
        return (), (Said(pulses),)
    wrong = tuple(ignored) if witness.mostly else ()
    other = contradicted(speeds, drives, width, limits) if ignored and not wrong else ""
    said = (Said(other),) if other else denied(witness, idle, drives, wrong, dt)
    return () if wrong or other else tuple(ignored), said
