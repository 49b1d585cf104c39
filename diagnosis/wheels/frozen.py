"""A speed that stays at one value to the last digit while the machine moves on: its sensor is frozen, whatever a model makes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.channels.one_value import TURNS, Frozen, frozen_of, trembling
from diagnosis.results.alike import SHIFTED_SENTENCE
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.slowing import or_held_together
from diagnosis.wheels.unshown import as_shown, followed, moves_on
from replay.faults import FaultMode, Side, State
from replay.signals.resolution import rounding_step

_INSIDE = 0.5  # of a finding's time
_OTHERS, _CHANGES, _AS_OFTEN = (
    2,
    40,
    0.5,
)  # wheels; changes that each other speed makes meanwhile, and as often as this one elsewhere
_DITHER = 1e-6  # of the largest reading: less is how a fraction was rounded, and no step
_SMALL = 0.1  # quantile of changes: those of noise are mostly several of its steps, those of a count are one
_P, _VALVE = 0.96, 0.02  # that the sensor is frozen, and that its valve is; set by hand, not calibrated
_FAR, _P_NEAR = (
    8.0,
    0.6,
)  # times the longest other run: right were 13 of 13 beyond (tuning, nine machines), none of 1 below


def with_frozen(data: WheelsData, found: Mapping[int, WheelFindings]) -> dict[int, WheelFindings]:
    """Findings in which frozen sensors are told as such; what models say of such a time instead is left out.

    Parameters
    ----------
    data : WheelsData
        Channels.
    found : Mapping[int, WheelFindings]
        By wheel.
    """
    held = {i: frozen_of(data.y[:, i], data.span, data.dt) for i in found}
    out = {}
    for i, wheel in found.items():
        own = [
            r
            for r in held[i]
            if (moves_on(data, i, followed(data, r.start, r.stop)) or _others_tremble(data, i, r))
            and not _all_held(held, i, r)
        ]
        kept = [
            as_shown(data, i, f, wheel.findings)
            for f in wheel.findings
            if _stuck(f) or not any(_inside(f, r) for r in own)
        ]
        told = {r: [f for f in kept if _says_so(f, r)] for r in own}
        same = [f for fs in told.values() for f in fs]
        findings = [f for f in kept if not any(f is g for g in same)]
        for r, fs in told.items():
            findings += [_surer(f, _told(data, i, r)) for f in fs] or [_told(data, i, r)]
        out[i] = replace(wheel, findings=sorted(findings, key=lambda f: f.start))
    told_of_all = or_held_together([wheel.findings for wheel in out.values()], data.dt)
    return {i: replace(wheel, findings=fs) for (i, wheel), fs in zip(out.items(), told_of_all, strict=True)}


def _others_tremble(data: WheelsData, i: int, r: Frozen) -> bool:
    """Whether all other speeds, and this one elsewhere, change again and again by a step of the reading and more, as none does meanwhile."""
    seconds = (r.stop - r.start) * data.dt
    inside = data.y[r.start : r.stop]
    elsewhere = np.concatenate([data.y[: r.start, i], data.y[r.stop :, i]])
    usual = trembling(elsewhere, TURNS * data.span)
    others = [trembling(inside[:, j], TURNS * data.span) for j in range(data.y.shape[1]) if j != i]
    if usual is None or len(others) < _OTHERS or any(t is None for t in others):
        return False
    known = [t for t in others if t is not None]
    step = _step_of(elsewhere[np.r_[True, np.diff(elsewhere) != 0.0]])
    rates = min(share for share, _ in known) / data.dt
    return bool(
        rates * seconds >= _CHANGES
        and min(share for share, _ in known) >= _AS_OFTEN * usual[0]
        and min(size for _, size in known) >= max(step, 1e-12)
    )


def _step_of(values: np.ndarray) -> float:
    """Step of readings, each of which is not the one before, shape (n,) [m/s]: teeth in a window are some, and its digits are finer."""
    changes = np.abs(np.diff(values))
    least = _DITHER * float(np.nanmax(np.abs(values), initial=0.0))
    changes = changes[changes > least]  # NaN are none
    few = float(np.quantile(changes, _SMALL)) if changes.size else 0.0
    return max(rounding_step(values), few)


def _all_held(held: Mapping[int, list[Frozen]], i: int, r: Frozen) -> bool:
    """Whether most other wheels stay at one value meanwhile, too: their log does."""
    others = [any(_common(r, o) > _INSIDE * (r.stop - r.start) for o in held[j]) for j in held if j != i]
    return bool(others) and sum(others) >= len(others) / 2


def _common(a: Frozen, b: Frozen) -> int:
    return min(a.stop, b.stop) - max(a.start, b.start)


def _inside(f: Finding, r: Frozen) -> bool:
    return min(f.stop, r.stop) - max(f.start, r.start) > _INSIDE * (f.stop - f.start)


def _stuck(f: Finding) -> bool:
    return (f.side, f.mode) == (Side.SENSOR, FaultMode.STUCK)


def _says_so(f: Finding, r: Frozen) -> bool:
    """Whether a finding says already that the sensor is stuck."""
    common = min(f.stop, r.stop) - max(f.start, r.start)
    return _stuck(f) and common > _INSIDE * min(r.stop - r.start, f.stop - f.start)


def _surer(f: Finding, frozen: Finding) -> Finding:
    """A finding with what its readings say; no less probable than that."""
    sure = f.probability >= frozen.probability
    # off by a constant, it would go on to show its noise
    evidence = (*(e for e in f.evidence if sure or e != SHIFTED_SENTENCE), *frozen.evidence)
    return replace(f if sure else replace(frozen, start=f.start, stop=f.stop, sat=f.sat), evidence=evidence)


def _told(data: WheelsData, i: int, r: Frozen) -> Finding:
    name, length = data.names[i][0], (r.stop - r.start) * data.dt
    p = _P if length >= _FAR * r.usual_s else _P_NEAR
    return Finding(
        start=r.start,
        stop=r.stop,
        side=Side.SENSOR,
        mode=FaultMode.STUCK,
        probability=p,
        hypotheses=(
            Hypothesis(Side.SENSOR.value, FaultMode.STUCK.value, p),
            Hypothesis(Side.ACTUATOR.value, FaultMode.STUCK.value, _VALVE),
            Hypothesis("none", State.HEALTHY.value, 1.0 - p - _VALVE),
        ),
        epsilon=Epsilon(1.0, 1.0, 1.0),
        sat=Sat(r.value, abs(r.value), r.value, r.value, "m/s"),
        evidence=(
            f"{name} stays at {plain(r.value)} m/s to the last digit for {lasting(length, 2)}; the longest that it "
            f"stays at another value is {r.usual_s:.2f} s.",
        ),
        tier=Tier.MODEL,
    )
