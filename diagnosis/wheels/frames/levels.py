"""Features of one wheel by window: levels, errors, slopes, noise, constancy, and what the other wheels do meanwhile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.frames.signals import MissionSignals, WheelSignals
from diagnosis.wheels.frames.windows import MISSING, Steps, bounded, windowed
from diagnosis.wheels.models import JointModel
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

_LEAST_SPEED = 0.02  # of the usual speed, below which a share of it says nothing
_LEAST_SHARE = 0.05  # of a window, of which something must be known


def level_features(i: int, model: JointModel, seen: MissionSignals, usual_rough: float, at: Steps, dt: float) -> Array:
    """Features of wheel i in frames at the steps `at` of dt [s], shape (frames, p); `usual_rough` as in `MissionSignals.rough`."""
    wheel = model.wheels[i]
    assert wheel is not None
    grip = 1.0 + (wheel.grip if wheel.grip_most > 0 else 0.0)
    parts = [f for w in windowed(_columns(i, model, seen), at, dt) for f in _of_window(w, grip, usual_rough)]
    return bounded(np.stack(parts, axis=1))


def _columns(i: int, model: JointModel, seen: MissionSignals) -> Array:
    """What is averaged, shape (n, columns)."""
    s = WheelSignals.of(i, seen)
    r, y, d, b, has_r, has_b, known = s.r, s.y, s.d, s.b, s.has_r, s.has_b, s.known
    kr, kb = known * has_r, known * has_b
    columns = (
        *(known, has_r, has_b, r * has_r, y * known, d, b * has_b),
        *(y * kr, r * kr, y * kb, b * kb, d * kb),
        *((y - r) ** 2 * kr, (y - b) ** 2 * kb, (d - r) ** 2 * has_r, (d - b) ** 2 * has_b),
        *((y - b) * (d - b) * kb, (y - b) * b * kb, b * b * kb),
        *(y * r * kr, r * r * kr, y * d * known, d * d * known, (y - d) ** 2 * known, y * y * known),
        *(seen.jitter[:, i], seen.root_jitter[:, i], seen.constant[:, i], (np.abs(y) < 1e-3) * known),
        *(seen.silent[:, i], seen.rests[:, i], seen.restless[:, i]),
        *(seen.quiet[:, i], seen.opening[:, i], seen.saturated[:, i], s.u, seen.rough[:, i], seen.unseen[:, i]),
        *_others(i, model, seen),
    )
    return np.stack([np.asarray(c, np.float64) for c in columns], axis=1)


def _others(i: int, model: JointModel, seen: MissionSignals) -> Array:
    """Median and largest of the other wheels: asked and measured beyond the command [1], roughness; shape (6, n)."""
    apart = []
    for j, wheel in enumerate(model.wheels):
        if wheel is None or j == i:
            continue
        toward, r = seen.toward(j) / seen.usual, np.nan_to_num(seen.reference[:, j])
        apart.append([(seen.asked[:, j] - r) * toward, (seen.speed[:, j] - r) * toward, seen.rough[:, j]])
    if not apart:
        return np.zeros((6, len(seen.speed)))
    found = np.array(apart)
    return np.concatenate([median_of(found, axis=0), np.abs(found).max(axis=0)])


def _share(a: Array, b: Array) -> Array:
    """a / b; `MISSING` where b, the square of a speed, is too small."""
    enough = np.abs(b) > _LEAST_SPEED**2
    return np.where(enough, a / np.where(enough, b, 1.0), MISSING)


def _of_window(w: Array, grip: float, usual_rough: float) -> list[Array]:
    """Features of one window from the means of `_columns`, shape (frames,) each; `grip`: asked slip per slip of a wheel."""
    (
        k,
        hr,
        hb,
        mr,
        my,
        md,
        mb,
        ykr,
        rkr,
        ykb,
        bkb,
        dkb,
        err,
        erb,
        drr,
        drb,
        cyd,
        cyb,
        cbb,
        cyr,
        crr,
        cyd2,
        cdd,
        eyd,
        yy,
    ) = w.T[:25]
    jit, jrt, const, zero, silent, rests, restless, quiet, au, sat, su, rough, unseen, od, oy, orough, xd, xy = w.T[
        25:43
    ]
    k0, kr0, kb0 = np.maximum(k, 1e-9), np.maximum(hr * k, 1e-9), np.maximum(hb * k, 1e-9)
    some, body = k > _LEAST_SHARE, hb > _LEAST_SHARE
    both = some & body

    def where(condition: NDArray[np.bool_], value: Array) -> Array:
        return np.where(condition, value, MISSING)

    def decades(value: Array) -> Array:
        return np.log10(1e-3 + value)

    least_rough = max(usual_rough, 1e-6)
    return [
        *(mr, where(some, my / k0), md, where(body, mb / np.maximum(hb, 1e-9))),
        *(where(some, (ykr - rkr) / kr0), where(both, (ykb - bkb) / kb0), md - mr, where(both, (dkb - bkb) / kb0)),
        where(some, (my - md * k) / k0),
        *(np.sqrt(np.maximum(err / kr0, 0)), np.sqrt(np.maximum(erb / kb0, 0)), np.sqrt(drr), np.sqrt(drb)),
        np.sqrt(np.maximum(eyd / k0, 0)),
        *(_share(cyd, drb) * grip, _share(cyb, cbb) * grip, _share(cyb, cbb), _share(cyr, crr), _share(cyd2, cdd)),
        np.sqrt(np.maximum(yy / k0 - (my / k0) ** 2, 0)),
        *(decades(jit / k0), decades(jrt / k0), const / k0, zero / k0, silent, rests, restless, quiet, k),
        *(au, sat, su, decades(rough / least_rough), np.minimum(unseen * 10, 8)),
        *(od, oy, xd, xy, (md - mr) - od, decades(orough / least_rough)),
    ]
