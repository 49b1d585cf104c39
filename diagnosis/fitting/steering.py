"""Steering axles of a machine from its healthy missions: valve map, lag and play of each, put into the machine file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.fitting.machine import Constant
from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, blocks_of, sensor_noise
from diagnosis.steering.identification import LONG_S, SHORT_S, AxleWindows, fit_axles
from diagnosis.steering.news import with_news
from diagnosis.steering.pace import body_speed, identified
from diagnosis.steering.prior import axle_plant_of
from diagnosis.steering.windows import Windows, windows_of
from replay.machine.axle_plant import AxlePlant
from replay.machine.config import Machine, Noise
from replay.signals.timeline import Timeline

_UNITS = {"slope": "rad/s per full opening", "dead": "of full opening", "limit": "rad/s", "lag": "s", "play": "rad"}
_FIELDS = ("slope_up", "slope_down", "dead_up", "dead_down", "limit_up", "limit_down", "lag", "play")


def fit_steering(timelines: Sequence[Timeline], machine: Machine, bad: set[str]) -> dict[str, AxlePlant]:
    """Constants of every axle whose command and angle the missions log and that they steer enough.

    Parameters
    ----------
    timelines : Sequence[Timeline]
        Aligned healthy missions.
    machine : Machine
        Its axles, end stops and noise.
    bad : set[str]
        Signals with wrong units; axles that rest on them are left out.
    """
    usable = [name for name in machine.axles if not {f"steer.{name}.{leaf}" for leaf in ("phi", "u")} & bad]
    found: dict[str, list[tuple[Windows, Windows]]] = {}
    for timeline in timelines:
        for name, pair in _windows(with_news(timeline, machine), usable, machine).items():
            found.setdefault(name, []).append(pair)
    names = [name for name in machine.axles if name in found]
    windows = [AxleWindows(tuple(w for w, _ in found[name]), tuple(w for _, w in found[name])) for name in names]
    plants = fit_axles(windows)
    return {n: axle_plant_of(p) for n, p in zip(names, plants, strict=True) if p is not None and p.reliable}


def _windows(timeline: Timeline, axles: Sequence[str], machine: Machine) -> dict[str, tuple[Windows, Windows]]:
    """Long and short windows of the axles of one mission whose command and angle are logged, at the pace of its speed of driving."""
    known: dict[str, tuple[SteeringBlocks, SensorNoise]] = {}
    for axle in axles:
        channel = f"steer.{axle}.phi"
        y, u = timeline.get(channel), timeline.get(f"steer.{axle}.u")
        if y is None or u is None or not np.isfinite(y).any() or not np.isfinite(u).any():
            continue
        fresh = timeline.fresh[channel]
        blocks = blocks_of(y, u, fresh, np.zeros(y.size, dtype=np.bool_), timeline.dt, timeline.store)
        stated = machine.noise.get(channel, Noise())
        known[axle] = blocks, sensor_noise(blocks, y[fresh & np.isfinite(y)], stated, machine.max_steer)
    given, noises = [b for b, _ in known.values()], [n for _, n in known.values()]
    paced, _ = identified(given, noises, body_speed(timeline, machine), machine, [None] * len(given))
    return {
        axle: (windows_of(b, n, machine.max_steer, LONG_S), windows_of(b, n, machine.max_steer, SHORT_S))
        for axle, b, n in zip(known, paced, noises, strict=True)
    }


def with_steering(
    out: Machine, machine: Machine, found: Mapping[str, AxlePlant], missions: int, constants: list[Constant]
) -> Machine:
    """Put the axles' constants into the steering section; axles that were not found stay as they were.

    Parameters
    ----------
    out : Machine
        What they are put into.
    machine : Machine
        What was known before.
    found : Mapping[str, AxlePlant]
        From `fit_steering`.
    missions : int
        Missions behind them.
    constants : list[Constant]
        Takes the constants.
    """
    for name in machine.axles:
        plant, before = found.get(name), machine.steering.get(name)
        for key in _FIELDS:
            value = None if plant is None else getattr(plant, key)
            why = "its command or angle is not logged, or it was steered too little" if plant is None else ""
            if plant is not None and value is None:
                why = "no opening has shown it"
            std = getattr(plant, f"{key}_std", None)
            old = None if before is None else getattr(before, key)
            unit = _UNITS[key.partition("_")[0]]
            constants.append(
                Constant(f"steering.{name}.{key}", value, std, unit, old, 0, missions, value is not None, why)
            )
    return replace(out, steering={**machine.steering, **found})
