"""The controller of a drive, identified from missions that may hold faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import quiet_rms
from diagnosis.drives.inputs import DriveRecord, stretches
from diagnosis.drives.inverse_controller import fading, high_passed, led
from replay.machine.drive_model import InverseController

Array = NDArray[np.float64]

_MEMORIES = np.geomspace(0.1, 12.0, 19)  # integral times that are tried [s]
_MOST_LEAD_S = 0.1
_TAPS = 3
_LEAST_S = 4.0
_MOST_SAMPLES = 20_000
_USUAL_S = 1.0  # integral time with which the delay is found
_TUKEY = 4.0
_LEAST_EXPLAINED = 0.5
_DRIFT_S = 1.0
_LEAST_STRETCHES = 3
_UNSURE = 0.1  # of Ti where one mission alone gives it


def identify_controller(records: Sequence[DriveRecord]) -> InverseController | None:
    """Identify the controller of a drive, as its inverse model, from missions that may hold faults in less than half of their time.

    Parameters
    ----------
    records : Sequence[DriveRecord]
        Missions with the same step, within a tenth; others are left out.

    Returns
    -------
    InverseController or None
        None where effort and command do not explain at least half of the variance of the tracking error.
    """
    if not records:
        return None
    dt = float(np.median([r.dt for r in records]))
    parts = [
        (record.y[p], record.command[p], record.u[p])
        for record in records
        if abs(record.dt - dt) <= 0.1 * dt
        for p in stretches(
            np.isfinite(record.y) & np.isfinite(record.command) & np.isfinite(record.u), round(_LEAST_S / dt)
        )
    ]
    if not parts or max(float(np.ptp(u)) for _, _, u in parts) <= 0:
        return None
    target = np.concatenate([y - r for y, r, _ in parts])
    every = max(1, target.size // _MOST_SAMPLES)

    def fitted(memory: float, first: int) -> tuple[float, Array]:
        design, error = _regression(parts, memory, dt, range(first, first + _TAPS), every)
        theta = _robust(design, error)
        return _spread(error - design @ theta), theta

    first = _lead(parts, _USUAL_S, dt, every) - _TAPS // 2
    memory = float(_MEMORIES[int(np.argmin([fitted(float(m), first)[0] for m in _MEMORIES]))])
    _, theta = fitted(memory, first)
    memory, unsure = _integral_time(parts, theta[:_TAPS], first, dt) or (memory, _UNSURE * memory)
    _, theta = fitted(memory, first)
    design, error = _regression(parts, memory, dt, range(first, first + _TAPS), 1)
    rest = error - design @ theta
    noise = quiet_rms(rest, dt)
    if not 0 < noise**2 < (1 - _LEAST_EXPLAINED) * quiet_rms(target, dt) ** 2:
        return None
    exact, core = _exact_share(rest[:: max(1, rest.size // _MOST_SAMPLES)], noise)
    return InverseController(
        gains=tuple(float(g) for g in theta[:_TAPS]),
        first=first,
        memory_s=memory,
        memory_std_s=unsure,
        setpoint=float(theta[_TAPS]),
        noise=noise,
        exact=exact,
        core=core,
        step_s=dt,
    )


def _integral_time(
    parts: Sequence[tuple[Array, Array, Array]], gains: Array, first: int, dt: float
) -> tuple[float, float] | None:
    """Ti and its standard deviation from how the integral part u + Kp·e follows ∫e; None where fewer than three stretches show it.

    The high-passed effort fixes Ti only loosely, while a drive that is long away from its command needs it well. The median
    over stretches bears faults in some of them; with a single mission they could not be told from another Ti.
    """
    total = float(np.sum(gains))
    if total >= 0 or len(parts) < _LEAST_STRETCHES:
        return None
    lead = first + int(np.argmin(gains))
    length = max(4, round(_DRIFT_S / dt))
    slopes, weights = [], []
    for y, r, u in parts:
        e = y - r
        count = e.size // length
        if count < 4:
            continue
        middle = [
            np.median(x[: count * length].reshape(count, length), axis=1)
            for x in (led(u, lead) - e / total, -np.cumsum(e) * dt)
        ]
        moved, pushed = (x - np.mean(x) for x in middle)
        weight = float(pushed @ pushed)
        if weight > 0:
            slopes.append(float(pushed @ moved) / weight)
            weights.append(weight)
    if len(slopes) < _LEAST_STRETCHES:
        return None
    found, share = np.array(slopes), np.array(weights) / float(np.sum(weights))
    order = np.argsort(found)
    slope = float(found[order][np.searchsorted(np.cumsum(share[order]), 0.5)])
    if slope <= 0:
        return None
    # spread of the stretches, each with its weight, over their effective number
    spread = float(np.sqrt(share @ (found - slope) ** 2 * float(share @ share) / max(1 - float(share @ share), 0.1)))
    memory = -1 / (total * slope)
    return memory, memory * min(spread / slope, 1.0)


def _exact_share(rest: Array, noise: float) -> tuple[float, float]:
    """Share and noise of the narrower of two normal distributions around 0, by expectation maximisation."""
    share, core, late = 0.5, 0.2 * noise, 1.4 * noise
    z = rest[np.abs(rest) < 5 * noise]
    for _ in range(100):
        a = share * np.exp(-0.5 * (z / core) ** 2) / core
        b = (1 - share) * np.exp(-0.5 * (z / late) ** 2) / late
        g = a / np.maximum(a + b, 1e-300)
        share = float(np.clip(np.mean(g), 0.02, 0.98))
        core = max(float(np.sqrt(g @ z**2 / max(float(np.sum(g)), 1e-9))), 0.01 * noise)
        late = max(float(np.sqrt((1 - g) @ z**2 / max(float(np.sum(1 - g)), 1e-9))), core)
    return share, core


def _lead(parts: Sequence[tuple[Array, Array, Array]], memory: float, dt: float, every: int) -> int:
    """Steps by which the effort answers later than the speed: where the high-passed effort opposes it most."""
    leads = range(-1, max(8, round(_MOST_LEAD_S / dt)) + 1)
    total = np.zeros(len(leads))
    for y, r, u in parts:
        h, e = high_passed(u, memory, dt), (y - r)[::every]
        e = np.clip(e - np.median(e), -3 * _spread(e), 3 * _spread(e))
        total += [float(led(h, k)[::every] @ e) for k in leads]
    return leads[int(np.argmin(total))]


def _regression(
    parts: Sequence[tuple[Array, Array, Array]], memory: float, dt: float, leads: range, every: int
) -> tuple[Array, Array]:
    """Design and target of e = v − r on the high-passed effort; the state before each stretch is projected out."""
    designs, targets = [], []
    for y, r, u in parts:
        h = high_passed(u, memory, dt)
        columns = [*(led(h, k) for k in leads), high_passed(r, memory, dt), y - r]
        design = np.column_stack([c[::every] for c in columns])
        fade = fading(y.size, memory, dt)[::every]
        fade /= np.sqrt(float(fade @ fade))
        design -= np.outer(fade, fade @ design)
        designs.append(design[:, :-1])
        targets.append(design[:, -1])
    return np.vstack(designs), np.concatenate(targets)


def _spread(x: Array) -> float:
    """Standard deviation by the median absolute deviation."""
    return 1.4826 * float(np.median(np.abs(x - np.median(x))))


def _robust(design: Array, target: Array) -> Array:
    """Tukey's biweight regression from a few reweighted steps; columns without variance get 0."""
    alive = np.ptp(design, axis=0) > 0
    used = design[:, alive]
    scale = np.sqrt(np.mean(used**2, axis=0))
    used = used / scale
    ridge = 1e-9 * target.size * np.eye(used.shape[1])
    weight = np.ones(target.size)
    solution = np.zeros(used.shape[1])
    for step in range(8):
        weighted = used * weight[:, None]
        solution = np.linalg.solve(used.T @ weighted + ridge, weighted.T @ target)
        rest = target - used @ solution
        size = _spread(rest)
        if size <= 0:
            break
        z = np.abs(rest) / size
        # first steps by the absolute value, which needs no good start
        weight = 1 / np.maximum(z, 0.3) if step < 4 else np.clip(1 - (z / _TUKEY) ** 2, 0.0, None) ** 2
    out = np.zeros(design.shape[1])
    out[alive] = solution / scale
    return out
