"""Constants of the wheel filters that are found in the mission itself: noise, load, and how the tyres hold the ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, quick_noise, slow_mismatch, usual_distance, usual_rounding, white_noise
from diagnosis.channels.sample_status import PAIR
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.body import with_body
from diagnosis.wheels.filter import forward
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import JointModel, WheelFilterModel
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_LEAST_LOAD, _MOST_LOAD = 0.0175, 0.1  # of the span
_GRIP_OF_LEAST = 3.2  # 1 + grip, from which on the least load grows with it
_TYRES = (0.027, 0.057, 0.114)  # slip at which a tyre transmits its largest load, of the span
_GRIP = 2.2  # where neither machine file nor mission shows it
_DRIFT = 0.0101  # least process noise of the speed, of the span per √s
_TRIAL_S = 60.0
_SMALL_NOISE, _OTHERS = (
    0.01,
    5.0,
)  # of the span, and times the usual noise of the other sensors: up to there it is a sensor's own


def joint_model(data: WheelsData, blocks: WheelBlocks) -> tuple[JointModel, WheelBlocks]:
    """Constants of all wheels' filters, on the ground or in the air by what explains the mission best.

    Also the blocks as they are to be read: with what sensors of the body say, and whether valves go on beyond the openings at
    which they were seen.
    """
    blocks = with_body(blocks, data.body)
    wheels = [None if p is None else filter_model(data, i) for i, p in enumerate(data.plants)]
    model = JointModel(
        wheels=of_usual_noise(wheels, data),
        flow=data.flow,
        switch_cost=float(np.log(_MEAN_HEALTHY_S / blocks.dt * 12)),
    )
    return _coupled(blocks, model, data)


def filter_model(data: WheelsData, i: int) -> WheelFilterModel:
    """Constants of one wheel's filter: noise and load are found from the mission where the machine file has none."""
    plant, residual = data.plants[i], data.residual[i]
    assert plant is not None
    pair, y = data.status[:, i] == PAIR, data.y[:, i]
    fresh = y[pair]
    period = data.dt * (usual_distance(pair) if fresh.size > 1 else 1.0)
    known = data.noise[i]
    lsb = known.lsb if known.lsb is not None else usual_rounding(fresh)
    white = known.std or float(np.nan_to_num(white_noise(fresh, period)))
    rounding = lsb / np.sqrt(12)
    noise = max(float(np.hypot(white, rounding)) if known.std else white, rounding, 1e-4 * data.span)
    growing = data.speed_noises[i]
    if growing is not None and not known.std:
        noise = max(growing.usual, rounding, 1e-4 * data.span)
    if period > 0.005:  # too slow to tell noise from motion by steps alone
        width = max(3, round(0.5 / data.dt))
        changing = moving_sum(np.diff(y, prepend=y[:1]) != 0, width) > 0.1 * width
        quick = quick_noise(np.where(pair & ~data.quiet[:, i] & changing, residual, np.nan), data.dt)
        noise = max(noise, float(np.nan_to_num(quick)))
    load = plant.load
    if load is None:
        load = float(np.nan_to_num(slow_mismatch(residual, pair & ~data.quiet[:, i], data.dt)))
    held = 1.0 + (plant.grip or 0.0)
    least = _LEAST_LOAD * max(1.0, held / _GRIP_OF_LEAST)
    return WheelFilterModel(
        K=plant.K,
        tau=plant.tau,
        noise=noise,
        # noise within one rounding step leaves readings constant for a while: that proves nothing then
        constant_noise=max(rounding / 3, noise / 50) if noise > lsb and not data.habits[i].stepwise else noise,
        rounding=max(rounding, 1e-5 * data.span),
        load=max(min(load, _MOST_LOAD * held * data.span), least * data.span, 0.5 * noise),
        span=data.span,
        valve_span=0.15 if data.span < 1.5 * plant.K else 0.5 * data.span / plant.K,
        offset=plant.offset,
        measured=data.measured[i],
        grip=_GRIP if plant.grip is None else plant.grip,
        drift=max(_DRIFT * data.span, plant.wander or 0.0),
    )


def of_usual_noise(wheels: Sequence[WheelFilterModel | None], data: WheelsData) -> tuple[WheelFilterModel | None, ...]:
    """Wheels whose sensors have no more noise than a few times what is usual of the others; what is stated of them stays.

    A sensor's noise is found over the whole mission, and so a fault that lasts as long would become it.

    Parameters
    ----------
    wheels : Sequence[WheelFilterModel or None]
        None where a wheel has no plant.
    data : WheelsData
        Of the mission: its span [m/s] and what the machine file states.
    """
    out = list(wheels)
    for i, wheel in enumerate(wheels):
        others = [w.noise for j, w in enumerate(wheels) if w is not None and j != i]
        if wheel is None or not others or data.noise[i].std:
            continue
        most = max(_SMALL_NOISE * data.span, _OTHERS * float(median_of(others)))
        if wheel.noise > most:
            out[i] = replace(wheel, noise=most, constant_noise=min(wheel.constant_noise, most))
    return tuple(out)


def _coupled(blocks: WheelBlocks, model: JointModel, data: WheelsData) -> tuple[JointModel, WheelBlocks]:
    """Tyres on the ground or wheels in the air, maps that end or go on: whichever explains a minute of driving best."""
    trials = [model]
    if data.coupling != "free" and np.isfinite(blocks.ratio).any():
        trials = _on_ground(model, data)
    driven = np.flatnonzero(~blocks.quiet.all(axis=1))
    if not driven.size:
        return trials[0], blocks
    middle = driven[driven.size // 2]
    if len(trials) > 1:
        trials = [max(trials, key=lambda trial: forward(_minute(blocks, middle), trial).evidence)]
    beyond = np.flatnonzero(blocks.unseen.any(axis=1))
    if beyond.size:
        part = _minute(blocks, beyond[beyond.size // 2])
        if forward(part.ending(), trials[0]).evidence > forward(part, trials[0]).evidence:
            return trials[0], blocks.ending()
    return trials[0], blocks


def _on_ground(model: JointModel, data: WheelsData) -> list[JointModel]:
    """Tyres that slide at several slips; also wheels in the air where nothing says that they stand on the ground."""
    known = [p.grip for p in data.plants if p is not None and p.grip is not None]
    if known and not any(known) and data.coupling != "ground":
        return [model]
    trials = [model.sliding_at(share * data.span) for share in _TYRES]
    return trials if known or data.coupling == "ground" else [model, *trials]


def _minute(blocks: WheelBlocks, middle: int) -> WheelBlocks:
    """Blocks around `middle`."""
    length = round(_TRIAL_S / blocks.dt)
    first = int(np.clip(middle - length // 2, 0, max(0, blocks.y.shape[0] - length)))
    return blocks.part(first, first + length)
