"""How far each wheel is from what it usually does in this mission, and the others meanwhile: no model of the plant is needed.

What is usual is a robust fit to the mission (opening and slip at a commanded speed), and the shortest half of what its
windows leave: up to half of the mission may be faulty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.frames.signals import MissionSignals, WheelSignals
from diagnosis.wheels.frames.windows import MIDDLE, WINDOWS, Steps, bounded, cuts, windowed
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

RELATIONS = 6  # slip, opening, tracking, asked less commanded, asked less measured, slip at this opening
_OF_OTHERS = (1, 2, 5, 6)  # windows in which the others are looked at
_STATED = 3  # relations whose plain values are features too
_ROUNDS, _TUKEY = 15, 4.7
_MOST_ROWS, _LEAST_ROWS = 4000, 20
_DRIVES = 0.1  # of the usual speed


@dataclass(frozen=True)
class Deviations:
    """One wheel against its usual self, by window.

    Attributes
    ----------
    scaled, values : tuple of Array, one per window, shape (frames, relations)
        Deviation in units of the usual spread, compressed by arsinh; and the plain value, NaN where unknown.
    shapes : tuple of Array, one per window, shape (frames, 8)
        Spread within the window, and how slip and tracking go with the opening.
    scales : Array, shape (relations,)
        Usual spread in the middle window.
    """

    scaled: tuple[Array, ...]
    values: tuple[Array, ...]
    shapes: tuple[Array, ...]
    scales: Array


def shorth(values: Array) -> tuple[float, float]:
    """Middle and width (as a standard deviation) of the shortest half of some values (Andrews et al., 1972).

    `values` of shape (n,); both results in their unit.
    """
    x = np.sort(values[np.isfinite(values)])
    if x.size < 8:
        return 0.0, 1.0
    half = x.size // 2
    widths = x[half:] - x[: x.size - half]
    k = int(np.argmin(widths))
    return float(0.5 * (x[k] + x[k + half])), float(max(widths[k] / 1.35, 1e-4))


def usual_weights(x: Array, basis: Array) -> Array:
    """Weights of regressors, shape (k,), by Tukey's biweight: what x (n,) usually is at `basis` (n, k)."""
    w: Array = np.zeros(basis.shape[1])
    weight: Array = np.ones(x.size)
    if x.size < _LEAST_ROWS:
        return w
    for _ in range(_ROUNDS):
        weighted = (basis * weight[:, None]).T
        w = np.asarray(np.linalg.solve(weighted @ basis + 1e-3 * np.eye(w.size), weighted @ x), np.float64)
        left = x - basis @ w
        middle, scale = shorth(left)  # of a third that are off to one side, the median would be pulled along
        weight = np.maximum(1.0 - ((left - middle) / (_TUKEY * max(scale, 1e-3))) ** 2, 0.0) ** 2 + 1e-6
    return w


@dataclass(frozen=True)
class _Relations:
    """Regressors of one wheel: of its opening, shape (n, 6), and of its slip, shape (n, 8); and what they explain."""

    opening: Array
    openings: Array
    slip: Array
    slips: Array
    driving: NDArray[np.bool_]
    signals: WheelSignals

    @classmethod
    def of(cls, i: int, seen: MissionSignals, dt: float) -> _Relations:
        s = WheelSignals.of(i, seen)
        signed = np.nan_to_num(seen.reference[:, i]) / seen.usual
        smooth = np.convolve(signed, np.ones(3) / 3, mode="same") if signed.size > 4 else signed
        rate = np.clip(np.gradient(smooth, dt), -5, 5) if signed.size > 1 else np.zeros(signed.size)
        turned = signed * np.nan_to_num(seen.ratio[:, i] - 1.0)
        columns = (signed, np.sign(signed), signed * np.abs(signed), np.ones(signed.size), rate, turned)
        openings = np.column_stack(columns)
        slips = np.column_stack([openings * s.toward[:, None], s.u, s.u * np.abs(signed)])
        driving = s.has_r & (np.abs(signed) > _DRIVES)
        return cls(seen.command[:, i], openings, (s.y - s.b) / (np.abs(s.b) + 0.1), slips, driving, s)

    def table(self, opening: Array, slip: Array) -> Array:
        """Relations, whether each is known, their products, and where the wheel drives, shape (n, 19), by weights of both."""
        s = self.signals
        both, tracked = s.known * s.has_b, s.known * s.has_r
        effort = (self.opening - self.openings @ opening) * s.toward * s.has_r
        off = self.slip - self.slips @ slip
        columns = (
            *(
                self.slip * both,
                effort,
                (s.y - s.r) * tracked,
                (s.d - s.r) * s.has_r,
                (s.d - s.y) * s.known,
                off * both,
            ),
            *(both, s.has_r, tracked, s.has_r, s.known, both),
            *(self.slip**2 * both, effort**2, (s.y - s.r) ** 2 * tracked, off**2 * both),
            *(self.slip * effort * both, (s.y - s.r) * effort * tracked),
            self.driving,
        )
        return np.stack([np.asarray(c, np.float64) for c in columns], axis=1)


def deviations(i: int, seen: MissionSignals, at: Steps, dt: float) -> Deviations:
    """How far wheel i is from its usual self in frames at the steps `at` of dt [s]."""
    opening, slip = _weights(i, seen, at, dt)
    parts: list[list[Array]] = [[] for _ in WINDOWS]
    for cut, mine in cuts(at, len(seen.speed), dt):
        table = _Relations.of(i, seen.part(cut), dt).table(opening, slip)
        for k, w in enumerate(windowed(table, mine, dt)):
            parts[k].append(w)
    scaled, values, shapes, scales = [], [], [], np.zeros(RELATIONS)
    q = RELATIONS
    for k, pieces in enumerate(parts):
        w = np.concatenate(pieces)
        drives = w[:, -1] > 0.8
        mean = np.where(w[:, q : 2 * q] > 0.2, w[:, :q] / np.maximum(w[:, q : 2 * q], 1e-9), np.nan)
        usual = np.array([shorth(mean[drives, j]) for j in range(q)])
        scaled.append(np.arcsinh((mean - usual[:, 0]) / usual[:, 1]))
        values.append(mean)
        shapes.append(_shapes(w, mean, drives))
        if k == MIDDLE:
            scales = usual[:, 1]
    return Deviations(tuple(scaled), tuple(values), tuple(shapes), scales)


def _shapes(w: Array, mean: Array, drives: NDArray[np.bool_]) -> Array:
    """Spread of slip, opening, tracking and slip at this opening against the usual one, and slopes, shape (frames, 8).

    Spreads are in decades; slope and correlation are those of slip and of tracking with the opening.
    """
    q = RELATIONS
    known = np.maximum(w[:, [q, q + 1, q + 2, q + 5]], 1e-9)
    spread = np.sqrt(np.maximum(w[:, 2 * q : 2 * q + 4] / known - mean[:, [0, 1, 2, 5]] ** 2, 0.0)) + 1e-5
    usual = np.array([median_of(x) if (x := s[drives & np.isfinite(s)]).size else 1.0 for s in spread.T])
    out = [*np.log10(spread / usual).T]
    for product, first in ((2 * q + 4, 0), (2 * q + 5, 2)):
        joint = w[:, product] / known[:, first] - mean[:, first] * mean[:, 1]
        out += [joint / (spread[:, 1] ** 2 + 1e-4), joint / (spread[:, 1] * spread[:, first] + 1e-6)]
    return np.stack(out, axis=1)


def _weights(i: int, seen: MissionSignals, at: Steps, dt: float) -> tuple[Array, Array]:
    """Weights of the regressors of opening and slip, fitted to some thousand steps of the mission."""
    kept: list[list[Array]] = [[], [], [], []]
    step = max(1, len(seen.speed) // _MOST_ROWS)
    for cut, _ in cuts(at, len(seen.speed), dt):
        found = _Relations.of(i, seen.part(cut), dt)
        drives = np.flatnonzero(found.driving)[::step]
        rolls = np.flatnonzero(found.driving & (found.signals.known > 0.5) & found.signals.has_b)[::step]
        for column, x in zip(
            kept, (found.opening[drives], found.openings[drives], found.slip[rolls], found.slips[rolls]), strict=True
        ):
            column.append(x)
    u, openings, slip, slips = (np.concatenate(column) for column in kept)
    return usual_weights(u, openings), usual_weights(slip, slips)


def deviation_features(i: int, found: Mapping[int, Deviations]) -> Array:
    """Features of wheel i by its own deviations and those of the others, shape (frames, p)."""
    own, others = found[i], [found[j] for j in found if j != i]
    frames = len(own.scaled[0])
    out = [*own.scaled, *own.shapes]
    for k in _OF_OTHERS:
        stated = own.values[k][:, :_STATED]
        if others:
            z = np.nan_to_num(np.array([o.scaled[k] for o in others]))
            v = median_of(np.nan_to_num(np.array([o.values[k] for o in others])), axis=0)[:, :_STATED]
            top = np.take_along_axis(z, np.abs(z).argmax(axis=0)[None], axis=0)[0]
            out += [median_of(z, axis=0), top, v, np.nan_to_num(stated) - v]
        else:
            out.append(np.zeros((frames, 2 * (RELATIONS + _STATED))))
        out.append(stated)
    out.append(np.tile(np.log10(own.scales), (frames, 1)))
    return bounded(np.concatenate(out, axis=1))
