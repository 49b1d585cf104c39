"""Efforts of several drives from healthy missions: what their motion takes, and by how much they are off that in a mission that was left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.efforts.inputs import wheels_with_efforts
from diagnosis.efforts.relation import fitted, held_share, largest_off, shares_of, usual_of
from diagnosis.efforts.windows import TERMS, EffortSteps, steps_of
from diagnosis.fitting.machine import Constant
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.machine.effort_model import LENGTHS_S, EffortModel
from replay.signals.timeline import Timeline

_LEAST_MISSIONS = 3


def fit_efforts(
    timelines: Sequence[Timeline], machine: Machine, replays: Sequence[Replay] = ()
) -> dict[str, EffortModel]:
    """Effort models of a machine's drives, by wheel; none where fewer than two wheels have efforts, or three missions enough driving.

    Parameters
    ----------
    timelines : Sequence[Timeline]
        Healthy missions.
    machine : Machine
        The machine; its own effort models are not used.
    replays : Sequence[Replay]
        Their replayed loops, for the commanded speeds; none: unknown.
    """
    wheels = tuple(w for w in machine.wheels if all(w in wheels_with_efforts(t, machine) for t in timelines))
    if len(wheels) < 2 or len(timelines) < _LEAST_MISSIONS:
        return {}
    least = machine.limits.driving_speed
    commands: Sequence[np.ndarray | None] = [r.v_ref for r in replays] or [None] * len(timelines)
    found = [steps_of(t, machine, wheels, c) for t, c in zip(timelines, commands, strict=True)]
    missions = [s for s in found if s.use.sum(axis=0).min() >= LENGTHS_S[1]]
    if len(missions) < _LEAST_MISSIONS:
        return {}
    theta = _fitted(missions, least)
    if theta is None:
        return {}
    off = np.zeros((len(wheels), len(LENGTHS_S)))
    usual = [_usual(missions, i) for i in range(len(wheels))]
    for k, left in enumerate(missions):
        without = _fitted([s for i, s in enumerate(missions) if i != k], least)
        if without is None:
            return {}
        off = np.maximum(off, largest_off(shares_of(left, without, usual, least), LENGTHS_S))
    pooled = tuple(float(x) for x in off.max(axis=0))  # wheels of one machine are alike, and missions few
    out = {}
    for i, w in enumerate(wheels):
        fastest = max(float(np.max(np.abs(s.speed[s.use[:, i], i]))) for s in missions)
        quickest = max(float(np.max(np.abs(np.nan_to_num(s.rate[s.use[:, i], i])))) for s in missions)
        terms = dict(zip(TERMS, (float(x) for x in theta[i]), strict=True))
        out[w] = EffortModel(
            **terms,
            usual=usual[i],
            off=pooled,
            fastest=fastest,
            quickest=quickest,
            held=_held(missions, i),
            missions=float(len(missions)),
        )
    return out


def _usual(missions: Sequence[EffortSteps], wheel: int) -> float:
    effort = np.concatenate([s.effort[:, wheel] for s in missions])
    return max(usual_of(effort, np.concatenate([s.use[:, wheel] for s in missions])), 1e-9)


def _held(missions: Sequence[EffortSteps], wheel: int) -> float:
    effort, command, speed, use = (
        np.concatenate([x[:, wheel] for x in xs])
        for xs in zip(*((s.effort, s.command, s.speed, s.use) for s in missions), strict=True)
    )
    return held_share(effort, command, speed, use)


def _fitted(missions: Sequence[EffortSteps], least: float) -> list[np.ndarray] | None:
    out = []
    for i in range(missions[0].effort.shape[1]):
        terms = np.concatenate([s.terms(i, least) for s in missions])
        effort = np.concatenate([s.effort[:, i] for s in missions])
        found = fitted(terms, effort, np.concatenate([s.use[:, i] for s in missions]))
        if found is None:
            return None
        out.append(found)
    return out


_UNITS = (
    ("friction", "unit of effort"),
    ("viscous", "unit of effort per m/s"),
    ("inertia", "unit of effort per m/s²"),
    ("usual", "unit of effort"),
    ("held", "of the usual effort"),
)


def with_efforts(
    out: Machine, machine: Machine, efforts: Mapping[str, EffortModel], constants: list[Constant]
) -> Machine:
    """Put effort models into the effort section; where none were found those of the given machine stay.

    Parameters
    ----------
    out, machine : Machine
        What they are put into, and the given machine.
    efforts : Mapping[str, EffortModel]
        By wheel, as found.
    constants : list[Constant]
        Takes the constants.
    """
    for wheel, model in efforts.items():
        before, count = machine.efforts.get(wheel), int(model.missions)
        for name, unit in _UNITS:
            old = None if before is None else float(getattr(before, name))
            constants.append(
                Constant(f"effort.{wheel}.{name}", float(getattr(model, name)), None, unit, old, 0, count, written=True)
            )
        for seconds, off in zip(LENGTHS_S[:-1], model.off, strict=False):
            why = "the largest of missions that were left out"
            constants.append(
                Constant(
                    f"effort.{wheel}.off ({seconds} s)",
                    off,
                    None,
                    "of the effort",
                    None,
                    0,
                    count,
                    written=True,
                    why=why,
                )
            )
    return replace(out, efforts={**machine.efforts, **efforts})
