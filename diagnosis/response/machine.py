"""What concerns the machine as a whole: drives that stand still or go astray together, wheels that are unlike the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.identification import Response
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.joint import Joint
from diagnosis.response.models import Beside
from diagnosis.response.shaken import quiet_meanwhile
from diagnosis.response.spells import Spell
from diagnosis.response.wheel import Wheel
from diagnosis.results.assessment import Finding, Lack, Reason
from diagnosis.results.plain_numbers import plain
from diagnosis.results.said import Said, Stated
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LASTING = 0.87  # of what the other wheels make of the same command: over a whole mission slip, drag and load make .94 of it at most
_NEAR = 0.5, 2.0  # of its command: what any healthy drive makes of it
_UNMADE, _UNMADE_S = (
    0.6,
    10.0,
)  # of its command, or it of that, and commanded time: nothing like the command is made of it
_ELSEWHERE, _ELSEWHERE_S = 0.35, 1.5  # of the top speed: all drives that far off their commands, for so long
_MOVES, _READINGS = 0.1, 100  # of a usual large speed; how many tell what a wheel reads of its command
_STATE_S = 4.0  # of that, from which on it is worth a verdict


class Judged(NamedTuple):
    """A wheel on the way.

    Attributes
    ----------
    data, response, wheel
        Its channels, what its command makes of it, its readings.
    driving : Flags, shape (b,)
        Blocks in which it moves, or is to.
    posterior : Array, shape (b, states)
        Probability of each state of `models`.
    spells : list[Spell]
        Faults along the most probable states.
    speed : Array or None, shape (b,)
        Its speed by other channels [m/s].
    calm : Flags, shape (b,)
        Blocks in which a jump would be seen.
    joint : Joint or None
        The position of its joint.
    alone : bool
        Whether it is the only drive.
    across : Array or None, shape (b,)
        As in `models.Beside`.
    rolls : bool
        Whether its effort is nothing from end to end while others pull, as that of a wheel without a drive.
    yaw : Array or None, shape (n,)
        Measured yaw rate of the body [rad/s].
    others : tuple[Array, ...], each of shape (n,)
        Readings of all other wheels [m/s].
    view : Beside or None
        What other channels say of its speed.
    odd : str
        Why its own answer to its commands cannot be right; empty where it may be.
    """

    data: FollowerData
    response: Response
    wheel: Wheel
    driving: Flags
    posterior: Array
    spells: list[Spell]
    speed: Array | None
    calm: Flags
    joint: Joint | None = None
    alone: bool = False
    across: Array | None = None
    rolls: bool = False
    yaw: Array | None = None
    others: tuple[Array, ...] = ()
    odd: str = ""
    view: Beside | None = None


def standstills(idle: Sequence[tuple[int, int]], dt: float, quiet: Sequence[tuple[int, int]] = ()) -> tuple[Said, ...]:
    """What is said where all drives stood still together, in steps [start, stop), although they were commanded to move; `dt` in s.

    `quiet`: those of these times in which an inertial unit shows that the machine stood.
    """
    if not idle:
        return ()
    total, (start, stop) = sum(b - a for a, b in idle) * dt, max(idle, key=lambda s: s[1] - s[0])
    text = (
        f"For {total:.1f} s all drives stood still together, one that reads wrong perhaps excepted, while they were commanded to move (longest {Stated.of(start * dt, stop * dt)}): "
        "disabled, stopped by an emergency stop, or driven by another source of commands; no {wheel} is blamed for it."
    ) + quiet_meanwhile(quiet, dt)
    return (Said(text, tuple((a * dt, b * dt) for a, b in idle)),)


def pauses(findings: Sequence[Finding]) -> list[Finding]:
    """Findings of the only drive that it stood still, or its sensor was dead."""
    return [f for f in findings if f.mode is FaultMode.NO_SIGNAL and f.side is Side.SENSOR_OR_ACTUATOR]


def paused(findings: Sequence[Finding], dt: float, quiet: Sequence[tuple[int, int]] = ()) -> tuple[Said, ...]:
    """What is said where the only drive stood still for a time although it was commanded to move, by what was found of it; `dt` in s, `quiet` as for `standstills`."""
    spans = pauses(findings)
    if not spans:
        return ()
    longest = max(spans, key=lambda f: f.stop - f.start)
    text = (
        f"For {sum(f.stop - f.start for f in spans) * dt:.1f} s the only drive stood still, or read 0, while it was commanded to move (longest "
        f"{Stated.of(longest.start * dt, longest.stop * dt)}): disabled, stopped by an emergency stop, driven by another source of commands, "
        "or faulty; with a single drive these look the same."
    ) + quiet_meanwhile(quiet, dt)
    return (Said(text, tuple((f.start * dt, f.stop * dt) for f in spans)),)


def unexplained(drives: Sequence[FollowerData], limits: Limits, dt: float) -> tuple[str, ...]:
    """A sentence where no drive makes anything like its command of it, over the whole mission.

    Parameters
    ----------
    drives : Sequence[FollowerData]
        Drives of which no answer to their commands could be found.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    made, asked = [], []
    for d in drives:
        driven = np.isfinite(d.y) & (np.abs(np.nan_to_num(d.asked)) > limits.driving_speed)
        if np.count_nonzero(driven) * dt < _UNMADE_S:
            return ()
        asked.append(float(np.median(np.abs(d.asked[driven]))))
        made.append(float(np.median(np.abs(d.y[driven]))))
    shares = [m / a for m, a in zip(made, asked, strict=True)]
    if not shares or not (max(shares) <= _UNMADE or min(shares) >= 1.0 / _UNMADE):
        return ()
    return (
        f"The drives were commanded to {plain(np.median(asked), 2)} {{speed_unit}} and made {plain(np.median(made), 2)} {{speed_unit}} of it (medians), and "
        "nothing relates the two: another source of commands, a wrong unit, a limit, or a machine that is held; no {wheel} is blamed for it.",
    )


def otherwise(judged: Mapping[str, Judged], block_s: float, followed: Flags) -> tuple[tuple[Said, ...], bool]:
    """What is said where all drives together did something else than their commands, and whether so long that it is the machine's state.

    No wheel is blamed for it. `block_s` is the length of a block [s]; `followed`, shape (b,), are those in which a receiver shows that
    the machine went as it was told.
    """
    off = []
    for j in judged.values():
        if not j.response.answered:
            return (), False
        b = j.wheel.blocks
        off.append(np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _ELSEWHERE * np.nanquantile(np.abs(b.mean), 0.99))
    together = [(a * block_s, b * block_s) for a, b in runs_of(np.logical_and.reduce(off) & ~followed)]
    spans = [(a, b) for a, b in together if b - a >= _ELSEWHERE_S]
    if len(judged) < 2 or not spans:
        return (), False
    longest = max(spans, key=lambda s: s[1] - s[0])
    text = (
        f"For {sum(b - a for a, b in spans):.1f} s all drives together did something else than their commands (longest "
        f"{Stated.of(*longest)}): commands that are held or ignored, another source of commands, or a slope; no {{wheel}} is "
        "blamed for it."
    )
    return (Said(text, tuple(spans)),), bool(longest[1] - longest[0] >= _STATE_S)


def unlike(judged: Mapping[str, Judged]) -> dict[str, Reason]:
    """Wheels that make something else of their command than other wheels do, or any drive would, with a sentence."""
    out = {w: _unlike(w, share, judged) for w, share in unlike_others(judged).items()}
    for w, own in _made(judged).items():
        if w not in out and not _NEAR[0] <= own <= _NEAR[1]:
            out[w] = Reason(
                f"over the whole mission it reads {plain(own, 2)} × its command: a wrong unit of one of them, another wheel diameter, or a "
                "wrongly mapped channel",
                Lack.UNIT,
            )
    return out


def _unlike(wheel: str, share: float, judged: Mapping[str, Judged]) -> Reason:
    """The sentence of a wheel whose answer is `share` of what the others make of its command."""
    readings = {w: _reads(j) for w, j in judged.items() if j.response.answered}
    others = [x for w, x in readings.items() if w != wheel and np.isfinite(x)]
    beside = readings.get(wheel, np.nan) / float(np.median(others)) if others else np.nan
    if _LASTING <= beside <= 1.0 / _LASTING:
        return Reason(
            f"where it is told to move and moves it reads {beside:.2f} × what the other {{wheels}} make of the same command, but the answer that "
            f"was found for the whole mission is {share:.2f} × theirs: it did not follow its commands all the time"
        )
    return Reason(
        f"over the whole mission it reads {share:.2f} × what the other {{wheels}} make of the same command: a scaled or wrongly "
        "mapped sensor, {or_size}a weak {valve}"
    )


def _reads(one: Judged) -> float:
    """Usual share of its command that a wheel reads where it is told to move and moves [1]; NaN where that is seldom."""
    y, asked = np.abs(np.nan_to_num(one.data.y)), np.abs(np.nan_to_num(one.data.asked))
    known = one.data.fresh & (y > 0.0) & (asked > 0.0)
    if np.count_nonzero(known) < _READINGS:
        return np.nan
    known &= (y > _MOVES * np.quantile(y[known], 0.9)) & (asked > _MOVES * np.quantile(asked[known], 0.9))
    return float(np.median(y[known] / asked[known])) if np.count_nonzero(known) >= _READINGS else np.nan


def unlike_others(judged: Mapping[str, Judged]) -> dict[str, float]:
    """What wheels that are unlike the others make of their commands beside what those make of them [1]."""
    return {w: share for w, share in _shares(judged).items() if not _LASTING <= share <= 1.0 / _LASTING}


def _made(judged: Mapping[str, Judged]) -> dict[str, float]:
    """What each wheel makes of its command [1]."""
    return {w: share for w, j in judged.items() if j.response.answered and np.isfinite(share := _share_made(j))}


def _share_made(one: Judged) -> float:
    """What a wheel makes of a commanded speed, or, where only turns are ever asked for, of what these ask of it [1]; NaN where that is nothing."""
    commands = np.nan_to_num(one.data.commands)
    weights = one.response.left(one.data.commands)
    if np.any(np.abs(commands[:, 0]) > 0.0):
        return abs(float(weights[0]))
    asked = np.nan_to_num(cells(one.data.asked, -(-one.data.asked.size // len(commands))))[: len(commands)]
    power = float(asked @ asked)
    return abs(float(asked @ (commands @ weights)[: asked.size])) / power if power > 0.0 else np.nan


def lasting_losses(judged: Mapping[str, Judged]) -> dict[str, float]:
    """Smallest loss [1] over the whole mission by which a wheel would be `unlike` the others; infinite where none can be.

    The response itself is found in the mission and takes such a loss for its own.
    """
    shares = _shares(judged)
    return {w: max(1.0 - _LASTING / shares[w], 0.0) if w in shares else np.inf for w in judged}


def _shares(judged: Mapping[str, Judged]) -> dict[str, float]:
    """What each wheel makes of its command beside what the others make of it [1]; wheels without any to compare are left out."""
    made, out = _made(judged), {}
    for w, own in made.items():
        others = [x for o, x in made.items() if o != w]
        if others and 0.0 < own < np.inf:
            out[w] = own / float(np.median(others))
    return out
