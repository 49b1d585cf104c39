"""Compiled: what the wheels share in one block, the pump's flow and the speed of the body."""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from diagnosis.estimation.back_pointers import STAY
from diagnosis.wheels.entry_kernel import is_scaled
from diagnosis.wheels.joint_types import (
    DRIVE,
    DRIVE_HALF,
    DRIVE_NONE,
    LAGGED_DRIVE,
    SHARE_NONE,
    SHARE_SOME,
    JointConstants,
    JointInput,
    JointState,
    JointWork,
)
from diagnosis.wheels.models import A_BIAS, A_GAIN, A_NONE, A_STUCK, HEALTHY, ODD, S_GAIN, WheelConstants
from replay.arrays.compiling import njit

Array = NDArray[np.float64]

LEAST_DOUBT = 0.01  # of the span: what wheels that agree may all be off
_CONSTANTS = len(WheelConstants._fields)
_APART = 3.0  # standard deviations from which on wheels and sensors of the body contradict each other


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def constants_of(row: Array) -> WheelConstants:
    """Constants of one wheel. `row` of shape (constants,)."""
    return WheelConstants(*to_fixed_tuple(row, _CONSTANTS))


@njit(cache=True, error_model="numpy")
def taken(m: int, gain: float, bias: float, K: float, x: float) -> float:
    """Speed for which a valve in model m takes flow, at commanded opening x [m/s]."""
    if m == A_STUCK:
        return abs(bias)
    if m == A_NONE:
        return 0.0
    if m == A_BIAS:
        return abs(gain * K * x + bias)
    if m == A_GAIN:
        return abs(gain * K * x)
    return abs(K * x)


@njit(cache=True, error_model="numpy")
def weights(lag: float, here: Array, after: Array) -> None:
    """Weights with which an opening at place q of a block drives the mean speed of its own and of the next block.

    `here` and `after` of shape (samples of a block,); `lag` is the length of a block over τ [1].
    """
    width = here.size
    a = np.exp(-lag / width)
    c = (1.0 - a) / (1.0 - np.exp(-lag)) / width
    for q in range(width):
        here[q], after[q] = 0.0, 0.0
        for n in range(q + 1, width):
            here[q] += c * a ** (n - 1 - q)
        for n in range(width, q + width + 1):
            after[q] += c * a ** (n - 1 - q)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _trust_in(m: int) -> float:
    """Weight of a wheel in model m when the speed of the body is estimated."""
    if m >= A_GAIN:
        return 0.7
    if m == S_GAIN:
        return 0.4
    if m == ODD:
        return 0.7
    return 1.0 if m == HEALTHY else 0.15


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def see(
    n: int, i: int, k: WheelConstants, known: bool, models: int, blocks: JointInput, state: JointState, work: JointWork
) -> None:
    """Most probable model of wheel i, the one in which the others take it to be, and the body's speed by it."""
    z = state.mean
    m = int(np.argmax(state.score[i, :models]))
    work.top[i] = m
    if blocks.given[n, i] != STAY:
        m = int(blocks.given[n, i])
    work.seen[i] = m
    v = z[i, m, 0] / max(z[i, m, 1], 0.1) if is_scaled(m) else z[i, m, 0]
    if k.grip_most > 0.0:  # a driven wheel that the body holds back runs a little off it
        v += min(max((v - state.carried[i, LAGGED_DRIVE]) / k.grip, -0.5 * k.grip_most), 0.5 * k.grip_most)
    speed = (v + blocks.turn[n, i]) / blocks.ratio[n, i]
    if known and speed == speed:
        work.speed[i], work.trust[i] = speed, _trust_in(m)
    else:
        work.speed[i], work.trust[i] = 0.0, 0.0


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def feed(
    n: int, blocks: JointInput, constants: JointConstants, state: JointState, work: JointWork, inputs: Array
) -> None:
    """Openings of every wheel as the pump feeds them in block n, written into `inputs`, (wheels, 8), and `carried`."""
    z, carried, K, flow = state.mean, state.carried, constants.K, constants.flow
    wheels, width = work.here.shape
    for i in range(wheels):
        for d in range(DRIVE, DRIVE_NONE + 1):
            inputs[i, d], carried[i, d] = carried[i, d], 0.0
    for q in range(width):
        total = 0.0
        for j in range(wheels):
            m = work.seen[j]
            u = blocks.u[n * width + q, j]
            work.taken[j] = taken(m, z[j, m, 1], z[j, m, 3], K[j], u) if constants.known[j] else 0.0
            total += work.taken[j]
        for i in range(wheels):
            if not constants.known[i]:
                continue
            x, others = blocks.u[n * width + q, i], total - work.taken[i]
            own = K[i] * abs(x)
            full, half, idle, some = x, x, 1.0, 1.0
            if others + max(own, 0.15 * K[i]) > flow:  # the pump cannot feed all
                full *= min(1.0, flow / max(others + own, 1e-9))
                half *= min(1.0, flow / max(others + 0.5 * own, 1e-9))
                idle = min(1.0, flow / max(others, 1e-9))
                some = min(1.0, flow / max(others + 0.15 * K[i], 1e-9))
            here, after = work.here[i, q], work.after[i, q]
            inputs[i, DRIVE] += here * full
            inputs[i, DRIVE_HALF] += here * half
            inputs[i, DRIVE_NONE] += here * x * idle
            inputs[i, SHARE_NONE] += idle / width
            inputs[i, SHARE_SOME] += some / width
            carried[i, DRIVE] += after * full
            carried[i, DRIVE_HALF] += after * half
            carried[i, DRIVE_NONE] += after * x * idle


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def rolls_at(i: int, speed: Array, trust: Array) -> tuple[float, float]:
    """Weighted median of the other wheels' speeds of the body, and their mean distance from it; NaN without any.

    `speed` and `trust` of shape (wheels,); m/s.
    """
    body, doubt = np.nan, 0.0
    total = trust.sum() - trust[i]
    if total > 0.0:
        least = 1e300
        for j in range(trust.size):
            if j == i or trust[j] == 0.0:
                continue
            far = 0.0
            for h in range(trust.size):
                if h != i:
                    far += trust[h] * abs(speed[h] - speed[j])
            if far < least:
                least, body = far, speed[j]
        doubt = least / total
    return body, doubt


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def lagged(m: int, k: WheelConstants, x: Array, z: Array, before: float) -> float:
    """What valve and lag alone ask of a wheel in model m after a block with inputs x [m/s].

    `x` of shape (8,), `z` of shape (models, 4).
    """
    takes = x[DRIVE]
    if m == A_GAIN or m == A_BIAS:
        takes *= z[m, 1]
    elif m == A_STUCK or m == A_NONE:
        takes = 0.0
    asked = k.K * takes + (z[m, 3] * x[SHARE_SOME] if m == A_STUCK or m == A_BIAS else 0.0)
    a = np.exp(-k.lag)
    return float(a * before + (1.0 - a) * asked)


@njit(cache=True, error_model="numpy", forceinline=True)
def with_sensors(body: float, doubt: float, sensed: float, std: float, least: float) -> tuple[float, float]:
    """Speed at which a wheel rolls, and its doubt, by the other wheels (`body`, `doubt`) and by sensors of the body.

    Both weigh by their variances; where they contradict each other, wheels that agree upon a fault of theirs are believed
    less than a sensor that has nothing to do with them.

    All in m/s.
    """
    if sensed != sensed:
        return body, doubt
    if body != body:
        return sensed, std
    own, other = (doubt + least) ** 2, std**2
    apart = abs(body - sensed)
    if apart * apart > _APART**2 * (own + other):
        return sensed, np.sqrt(other)
    share = own / (own + other)
    return body + share * (sensed - body), np.sqrt(own * other / (own + other))
