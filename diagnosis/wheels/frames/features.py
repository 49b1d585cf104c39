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
from diagnosis.wheels.frames.signals import MissionSignals
from diagnosis.wheels.frames.windows import LARGEST, Blocks, cuts
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


def mission_features(
    data: WheelsData,
    blocks: WheelBlocks,
    model: JointModel,
    followed: Mapping[int, Followed],
    at: Blocks,
    *,
    gains: bool,
) -> dict[int, NDArray[np.float32]]:
    """Features of every wheel with a model, shape (frames, p) each.

    Parameters
    ----------
    data, blocks, model
        The wheels.
    followed : Mapping[int, Followed]
        By wheel.
    at : NDArray[np.int64], shape (frames,)
        Blocks in the middle of the frames.
    gains : bool
        Whether the wheel model is good enough to judge gains and valves by.
    """
    seen, n = MissionSignals.of(data, blocks, model), len(blocks.y)
    off = {i: deviations(i, blocks, seen, at) for i in followed}
    out = {}
    for i, own in followed.items():
        others = [followed[j].path for j in followed if j != i]
        rough = seen.rough[~blocks.quiet[:, i], i]
        usual_rough = float(np.median(rough)) if rough.size else 1.0
        levels, paths = [], []
        for cut, mine in cuts(at, n, blocks.dt):
            part = blocks if cut.stop - cut.start == n else blocks.part(cut.start, cut.stop)
            levels.append(level_features(i, part, model, seen.part(cut), usual_rough, mine))
            paths.append(path_features(own.path[cut], [p[cut] for p in others], own.fault[cut], mine, blocks.dt))
        runs = run_features(own.described, own.runs, at, blocks.dt)
        constant = np.tile(_constant(i, data, blocks, model, gains=gains), (at.size, 1))
        columns = (np.concatenate(levels), deviation_features(i, off), runs, np.concatenate(paths), constant)
        out[i] = np.concatenate(columns, axis=1).astype(np.float32)
    return out


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
