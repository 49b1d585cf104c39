"""Wheels that read nothing from the start of a log to its end while all others turn, where no command says what they should do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.channels.standstill import STILL
from diagnosis.response.machine import Judged
from diagnosis.results.assessment import CODE, Assessment, Reason
from diagnosis.results.vocabulary import Tier
from replay.faults import State

_OTHERS = 2  # wheels that must turn meanwhile, or the only other one
_TURNS_S = 10.0  # for which each of them drives
_SAID = (
    "it reads 0 from start to end while every other {wheel} turns, and no command says what it should do: a dead sensor, a drive that never turns, or a "
    "channel that nothing fills"
)
_ABOUT = "; or a machine that did nothing but turn about this {wheel}"


def motionless(judged: Mapping[str, Judged], driving_speed: float, block_s: float) -> dict[str, Reason]:
    """Wheels that never read any motion although all others drive, with a sentence.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    driving_speed : float
        Speed from which a wheel drives [m/s].
    block_s : float
        Length of a block [s].
    """
    speeds = {w: np.abs(np.nan_to_num(j.wheel.blocks.mean)) for w, j in judged.items()}
    turns = {w: float(np.count_nonzero(x > driving_speed)) * block_s >= _TURNS_S for w, x in speeds.items()}
    still = [w for w, x in speeds.items() if np.max(x, initial=0.0) <= STILL * driving_speed]
    turning = sum(turns.values())
    if turning < min(_OTHERS, len(judged) - 1) or not turning or len(still) + turning < len(judged):
        return {}
    why = Reason(_SAID + (_ABOUT if turning == 1 else ""))
    return {w: why for w in still if not judged[w].response.answered}


def not_moving(sensor: Assessment, drive: Assessment, why: Reason) -> tuple[Assessment, Assessment]:
    """Both sides of such a wheel, of which nothing is judged at any time; that it rests is what is in question."""
    return _open(sensor, why), _open(drive, why)


def _open(part: Assessment, why: Reason) -> Assessment:
    rests = part.states == CODE[State.NOT_EXCITED]
    states = np.where(rests, CODE[State.NOT_ASSESSED], part.states)
    return replace(part, states=states.astype(part.states.dtype), tier=Tier.NONE).reasoned(State.NOT_ASSESSED, why)
