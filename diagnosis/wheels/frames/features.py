"""All features of a mission's wheels, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.frames.deviations import deviation_features, deviations
from diagnosis.wheels.frames.levels import level_features
from diagnosis.wheels.frames.paths import Path, path_features, run_features
from diagnosis.wheels.frames.signals import MissionSignals, step_width
from diagnosis.wheels.frames.windows import LARGEST, cuts, frames_at
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import JointModel
from diagnosis.wheels.runs import Runs

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Followed:
    """What the Kalman models made of one wheel.

    Attributes
    ----------
    path : NDArray[np.uint8], shape (n,)
        Most probable model of each block.
    runs : Runs
        Of the path.
    described : Array, shape (runs, q)
        Features of each run.
    fault : Array, shape (n,)
        Probability by what came before that the wheel is faulty.
    """

    path: Path
    runs: Runs
    described: Array
    fault: Array


@dataclass(frozen=True)
class Features:
    """Features of a mission.

    Attributes
    ----------
    of : dict[int, NDArray[np.float32]], shape (frames, p) each
        By wheel.
    hop : int
        Blocks from frame to frame; the first frame begins with the first block.
    """

    of: dict[int, NDArray[np.float32]]
    hop: int


def mission_features(
    data: WheelsData, blocks: WheelBlocks, model: JointModel, followed: Mapping[int, Followed], *, gains: bool
) -> Features:
    """Features of every wheel with a model.

    Parameters
    ----------
    data, blocks, model
        The wheels.
    followed : Mapping[int, Followed]
        By wheel.
    gains : bool
        Whether the wheel model is good enough to judge gains and valves by.
    """
    seen, width = MissionSignals.of(data, blocks, model), step_width(blocks.dt)
    n, dt = len(seen.speed), width * blocks.dt
    at = frames_at(n, dt)
    off = {i: deviations(i, seen, at, dt) for i in followed}
    out = {}
    for i, own in followed.items():
        others = [followed[j].path for j in followed if j != i]
        rough = seen.rough[seen.quiet[:, i] < 0.5, i]
        usual_rough = float(np.median(rough)) if rough.size else 1.0
        levels, paths = [], []
        for cut, mine in cuts(at, n, dt):
            levels.append(level_features(i, model, seen.part(cut), usual_rough, mine, dt))
            part = slice(cut.start * width, cut.stop * width)
            paths.append(path_features(own.path[part], [p[part] for p in others], own.fault[part], width, mine, dt))
        runs = run_features(own.described, own.runs, at * width + width // 2, blocks.dt)
        constant = np.tile(_constant(i, data, blocks, model, gains=gains), (at.size, 1))
        columns = (np.concatenate(levels), deviation_features(i, off), runs, np.concatenate(paths), constant)
        out[i] = np.concatenate(columns, axis=1).astype(np.float32)
    return Features(out, width * (int(at[1] - at[0]) if at.size > 1 else max(1, n)))


def _constant(i: int, data: WheelsData, blocks: WheelBlocks, model: JointModel, *, gains: bool) -> Array:
    """What stays the same during the mission, shape (13,)."""
    wheel = model.wheels[i]
    assert wheel is not None
    values = (
        *(data.misfit, float(gains), wheel.grip, float(wheel.grip_most > 0), wheel.K / data.span, wheel.tau),
        *(wheel.load / data.span, wheel.noise / data.span, np.log10(data.dt), float(data.measured[i])),
        *(float(data.habits[i].stepwise), wheel.drift, float(blocks.ended)),
    )
    return np.asarray(np.clip(np.array(values), -LARGEST, LARGEST))
