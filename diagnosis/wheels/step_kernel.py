"""Compiled Kalman step of one wheel's models: prediction and correction on the means of one block of samples.

A model's state is z = [ν, g, x, c] with covariance P: ν the speed as its sensor scales it, g the unknown gain of the
faulty side, x the load in units of its present standard deviation, c the stuck value or bias of the faulty side.
"""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.wheels.entry_kernel import is_scaled, known_covariances, known_states
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    COLOURED_S,
    HEALTHY,
    ODD,
    ODD_LOAD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_OU_SMALL,
    S_STUCK,
    S_WHITE_3,
    S_WHITE_8,
    S_WHITE_24,
    WheelConstants,
)
from replay.arrays.compiling import njit

Array = NDArray[np.float64]

_OCCAM = 0.5  # what a row with unknowns must gain on healthy per second
_WORST = 30.0  # by which a block can speak against a model at most
_SILENT = -6.0
_REVERSED = 1.0  # what a block costs a gain below zero
#: A stepwise sensor that holds its value for longer than its kind does, or that changes it more often.
RESTS, RESTLESS = 1, 2
_RESTS = 0.05  # of the noise: what is left of it
_RESTLESS_GAIN = 2.0  # what such a block says for noise
_NO_LOSS = 0.9  # a gain above this is none


class WheelInput(NamedTuple):
    """One block of one wheel."""

    y: float  # mean measured speed [m/s]
    samples: float  # new ones in it
    jitter: float  # mean squared step from sample to sample [m²/s²]
    white: float  # variance of its noise as a share of the usual one [1]
    slack: float  # how far the readings may be off because they are late [m/s]
    habit: int  # what they show by their updates alone, see `RESTS`
    drive: float  # mean opening as the pump feeds it, as this wheel's healthy valve asks [fraction]
    drive_half: float  # the same if its valve took half of that
    drive_none: float  # and if it took nothing
    share_none: float  # what the pump feeds of a demand while this valve takes nothing
    share_some: float  # and while it stands open by 15 %
    chatter: float  # speed error from openings that change within a sample [m/s]
    wander: float  # the same, where the log is too slow to sum them up [m/s]
    body: float  # speed at which this wheel would roll without slip [m/s]; NaN where unknown
    doubt: float  # its uncertainty [m/s]
    unseen: float  # by how much faster its valve may drive it than anyone has seen [m/s]


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _fed(m: int, q: WheelInput, k: WheelConstants, z: Array) -> tuple[float, float]:
    """Opening as the pump feeds it, and the share that it feeds, while model m takes its part of the flow."""
    if m == A_GAIN or m == A_BIAS:
        g = min(max(z[m, 1], 0.0), 1.0)
        if g > 0.5:
            drive = q.drive_half + (q.drive - q.drive_half) * (2.0 * g - 1.0)
        else:
            drive = q.drive_none + (q.drive_half - q.drive_none) * 2.0 * g
        return drive, q.share_some if m == A_BIAS else q.share_none
    share = q.share_none
    if m == A_STUCK:
        share += (q.share_some - q.share_none) * min(abs(z[m, 3]) / (0.15 * k.K), 2.0)
    return q.drive, share


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _tyre(m: int, q: WheelInput, k: WheelConstants, z: Array) -> tuple[float, float, float, float]:
    """Of ν' = a·ν + b·(drive + add + s·x): a, b, add and s, by whether the wheel runs free or its tyre holds or slides."""
    a = k.fade
    b, add, held = 1.0 - a, 0.0, 0.0
    if q.body == q.body and k.grip_most > 0.0:
        nu = z[m, 0] / max(z[m, 1], 0.1) if is_scaled(m) else z[m, 0]
        held = k.grip * (q.body - nu)
        if held > k.grip_most:
            held = k.grip_most
            add = held
        elif held < -k.grip_most:
            held = -k.grip_most
            add = held
        else:  # the tyre holds: the wheel follows the body, faster than its own lag
            a = k.fade_held
            b = (1.0 - a) / (1.0 + k.grip)
            add = k.grip * q.body
    add += k.offset
    doubt = min(k.grip * q.doubt, k.grip_most)
    load = k.load * ODD_LOAD if m == ODD else k.load
    s = np.sqrt(load**2 + (0.3 * held) ** 2 + doubt**2)
    if (
        q.samples > 0.0 and (q.y - z[m, 0]) * q.unseen > 0.0
    ):  # where no healthy wheel was seen, it may be faster, not slower
        s = np.hypot(s, q.unseen)
    if held < 0.0:
        s = -s
    return a, b, add, s


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _walk(m: int, k: WheelConstants) -> tuple[float, float]:
    """Share of c that is left after one block, and variance of what comes to it."""
    keep, noise = 1.0, 0.0
    if m == A_BIAS:
        keep = k.keep_bias
        noise = (1.0 - keep * keep) * (0.5 * k.valve_span) ** 2
    elif m == A_STUCK:
        noise = (0.02 * k.valve_span) ** 2 * k.dt
    elif m == S_OU_SMALL or m == S_OU_LARGE:
        keep = k.keep_noise
        noise = (1.0 - keep * keep) * ((0.05 if m == S_OU_SMALL else 0.12) * k.span) ** 2
    elif m >= S_WHITE_3 and m <= S_WHITE_24:
        noise = (0.05 * k.span) ** 2 * k.dt
    return keep, noise


@njit(cache=True, error_model="numpy", forceinline=True)
def predict(m: int, q: WheelInput, k: WheelConstants, z: Array, P: Array) -> float:
    """z = F z + G, P = F P Fᵀ + Q of model m over one block; the share of a demand that the pump feeds.

    τ ν̇ = −ν + K·opening + load, and the load is a tyre's: grip·(body − ν) up to `grip_most`, plus what x makes of it.

    `z` of shape (models, 4), `P` of shape (models, 4, 4); speeds in m/s.
    """
    z, P = known_states(z), known_covariances(P)
    drive, share = _fed(m, q, k, z)
    drive *= k.K
    a, b, add, s = _tyre(m, q, k, z)
    f0, f1, f2, f3, g = a, 0.0, b * s, 0.0, 0.0
    if is_scaled(m):
        f1 = b * (drive + add)
        f2 *= max(z[m, 1], 0.1)
    elif m >= A_GAIN:
        f1, f3, g = b * drive, b * share, b * add
    else:
        g = b * (drive + add)
    keep, noise = _walk(m, k)
    p0 = f0 * P[m, 0, 0] + f1 * P[m, 1, 0] + f2 * P[m, 2, 0] + f3 * P[m, 3, 0]
    p1 = f0 * P[m, 0, 1] + f1 * P[m, 1, 1] + f2 * P[m, 2, 1] + f3 * P[m, 3, 1]
    p2 = f0 * P[m, 0, 2] + f1 * P[m, 1, 2] + f2 * P[m, 2, 2] + f3 * P[m, 3, 2]
    p3 = f0 * P[m, 0, 3] + f1 * P[m, 1, 3] + f2 * P[m, 2, 3] + f3 * P[m, 3, 3]
    z[m, 0] = f0 * z[m, 0] + f1 * z[m, 1] + f2 * z[m, 2] + f3 * z[m, 3] + g
    z[m, 2] *= k.load_keep
    z[m, 3] *= keep
    P[m, 0, 0] = f0 * p0 + f1 * p1 + f2 * p2 + f3 * p3 + k.drift**2 * k.dt + q.wander**2
    P[m, 0, 1] = P[m, 1, 0] = p1
    P[m, 0, 2] = P[m, 2, 0] = k.load_keep * p2
    P[m, 0, 3] = P[m, 3, 0] = keep * p3
    P[m, 1, 2] = P[m, 2, 1] = k.load_keep * P[m, 1, 2]
    P[m, 1, 3] = P[m, 3, 1] = keep * P[m, 1, 3]
    P[m, 2, 2] = k.load_keep**2 * P[m, 2, 2] + 1.0 - k.load_keep**2
    P[m, 2, 3] = P[m, 3, 2] = k.load_keep * keep * P[m, 2, 3]
    P[m, 3, 3] = keep * keep * P[m, 3, 3] + noise
    return float(share)


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _readout(m: int, q: WheelInput, k: WheelConstants, z: Array) -> tuple[float, float, float, float]:
    """Row H = [h0, 0, 0, h3] of model m, variance of one sample's noise, and of its steps from sample to sample."""
    own = k.noise**2 * q.white
    if q.habit == RESTS and (m == S_STUCK or m == S_NONE):
        rest = (_RESTS * k.noise) ** 2
        return 0.0, 1.0 if m == S_STUCK else 0.0, rest, rest
    if m == S_STUCK:
        return 0.0, 1.0, k.constant_noise**2, k.constant_noise**2
    if m == S_NONE:
        return 0.0, 0.0, k.constant_noise**2, k.constant_noise**2
    if m == S_GAIN:
        g = min(max(z[m, 1], 0.1), 1.0)
        white = own * g * g + k.rounding**2
        return 1.0, 0.0, white, white
    if m == S_WHITE_3:
        return 1.0, 1.0, 9.0 * own, 9.0 * own
    if m == S_WHITE_8:
        return 1.0, 1.0, 64.0 * own, 64.0 * own
    if m == S_WHITE_24:
        return 1.0, 1.0, 576.0 * own, 576.0 * own
    if m == S_OU_SMALL or m == S_OU_LARGE:
        level = (0.05 if m == S_OU_SMALL else 0.12) * k.span
        return 1.0, 1.0, own, own + level**2 * k.raw_dt / COLOURED_S
    return 1.0, 0.0, own, own


@njit(cache=True, error_model="numpy", forceinline=True)
def least_steps(q: WheelInput, k: WheelConstants) -> float:
    """Variance of the steps from sample to sample [m²/s²] by which a block speaks for a model as well as it can."""
    return max(0.5 * q.jitter, k.constant_noise**2)


@njit(cache=True, error_model="numpy", forceinline=True)
def correct(m: int, q: WheelInput, share: float, k: WheelConstants, z: Array, P: Array, by_least: float) -> float:
    """Kalman update of model m with the block's mean; log-likelihood of mean and steps.

    The steps from sample to sample tell noise, and constancy, without any model of the wheel: their mean square is
    distributed as χ² with two thirds of a degree of freedom each.

    `z` of shape (models, 4), `P` of shape (models, 4, 4); `by_least` is the logarithm of `least_steps`, which all models share.
    """
    z, P = known_states(z), known_covariances(P)
    h0, h3, white, steps = _readout(m, q, k, z)
    r = white / max(q.samples, 1.0) + 1e-12
    if h0 > 0.0:
        r += (q.chatter * share) ** 2 + q.slack**2
    g0, g1 = P[m, 0, 0] * h0 + P[m, 0, 3] * h3, P[m, 0, 1] * h0 + P[m, 1, 3] * h3
    g2, g3 = P[m, 0, 2] * h0 + P[m, 2, 3] * h3, P[m, 0, 3] * h0 + P[m, 3, 3] * h3
    s = h0 * g0 + h3 * g3 + r
    innovation = q.y - h0 * z[m, 0] - h3 * z[m, 3]
    part = 1.0 / s
    k0, k1, k2, k3 = g0 * part, g1 * part, g2 * part, g3 * part
    z[m, 0] += k0 * innovation
    z[m, 1] += k1 * innovation
    z[m, 2] += k2 * innovation
    z[m, 3] += k3 * innovation
    P[m, 0, 0] -= k0 * g0
    P[m, 1, 1] -= k1 * g1
    P[m, 2, 2] -= k2 * g2
    P[m, 3, 3] -= k3 * g3
    P[m, 0, 1] -= k0 * g1
    P[m, 0, 2] -= k0 * g2
    P[m, 0, 3] -= k0 * g3
    P[m, 1, 2] -= k1 * g2
    P[m, 1, 3] -= k1 * g3
    P[m, 2, 3] -= k2 * g3
    P[m, 1, 0], P[m, 2, 0], P[m, 3, 0] = P[m, 0, 1], P[m, 0, 2], P[m, 0, 3]
    P[m, 2, 1], P[m, 3, 1], P[m, 3, 2] = P[m, 1, 2], P[m, 1, 3], P[m, 2, 3]
    by_mean = innovation * innovation * part + np.log(2.0 * np.pi * s)
    if q.habit == RESTLESS and m >= S_WHITE_3 and m <= S_OU_LARGE:
        by_mean -= 2.0 * _RESTLESS_GAIN
    if q.samples <= 1.5:
        return float(-0.5 * by_mean)
    freedom = 2.0 * q.samples / 3.0
    least = least_steps(q, k)
    # −½·freedom·(jitter/2/steps + log steps), but not below what noise of just this power gives, less 25
    spoken = freedom * (0.5 * q.jitter / steps + np.log(steps / least))
    return float(-0.5 * (by_mean + freedom * by_least + min(spoken, freedom + 50.0)))


@njit(cache=True, error_model="numpy")
def advance(
    models: int, q: WheelInput, status: int, quiet: bool, k: WheelConstants, z: Array, P: Array, gain: Array
) -> None:
    """One block of all models of one wheel; writes the log-likelihood of each into `gain`.

    `z` of shape (models, 4), `P` of shape (models, 4, 4), `gain` of shape (models,).
    """
    top, by_least = -1e300, np.log(least_steps(q, k))
    for m in range(models):
        share = predict(m, q, k, z, P)
        gain[m] = 0.0
        if status == SILENT:
            gain[m] = 0.0 if m == S_NONE else _SILENT
        elif status == PAIR:
            gain[m] = correct(m, q, share, k, z, P, by_least)
        top = max(top, gain[m])
    if status != PAIR:
        return
    for m in range(models):
        gain[m] = max(gain[m], top - _WORST)
        if m >= S_GAIN and m != A_NONE:
            gain[m] -= _OCCAM * k.dt
    if quiet:
        if abs(z[S_STUCK, 3]) < 3.0 * k.noise:
            gain[S_STUCK] = min(gain[S_STUCK], gain[HEALTHY])
        gain[S_NONE] = min(gain[S_NONE], gain[HEALTHY])
        gain[S_GAIN] = min(gain[S_GAIN], gain[HEALTHY])
        for m in range(A_GAIN, models):
            if m != A_STUCK:
                gain[m] = min(gain[m], gain[HEALTHY])
    for m in (S_GAIN, A_GAIN):
        if m < models and z[m, 1] > _NO_LOSS:
            gain[m] = min(gain[m], gain[HEALTHY] - k.dt)
        elif m < models and z[m, 1] < 0.0:
            gain[m] -= _REVERSED
