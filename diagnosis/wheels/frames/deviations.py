"""How far each wheel is from what it usually does in this mission, and the others meanwhile: no model of the plant is needed.

What is usual is a robust fit to the mission (opening and slip at a commanded speed), and the shortest half of what its
windows leave: up to half of the mission may be faulty.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.frames.signals import MissionSignals, WheelSignals
from diagnosis.wheels.frames.windows import MIDDLE, WINDOWS, Blocks, bounded, cuts, windowed

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
    scales : Array, shape (relations,)
        Usual spread in the middle window.
    """

    scaled: tuple[Array, ...]
    values: tuple[Array, ...]
    scales: Array


def shorth(values: Array) -> tuple[float, float]:
    """Middle and width (as a standard deviation) of the shortest half of some values (Andrews et al., 1972)."""
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
        scale = max(1.48 * float(np.median(np.abs(left))), 1e-3)
        weight = np.maximum(1.0 - (left / (_TUKEY * scale)) ** 2, 0.0) ** 2 + 1e-6
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
    def of(cls, i: int, blocks: WheelBlocks, seen: MissionSignals) -> _Relations:
        s = WheelSignals.of(i, blocks, seen)
        signed = np.nan_to_num(seen.reference[:, i]) / seen.usual
        near = max(1, round(0.05 / blocks.dt))
        smooth = signed
        if signed.size > 4 * near:
            smooth = np.convolve(signed, np.ones(2 * near + 1) / (2 * near + 1), mode="same")
        rate = np.clip(np.gradient(smooth, blocks.dt), -5, 5) if signed.size > 1 else np.zeros(signed.size)
        turned = signed * np.nan_to_num(blocks.ratio[:, i] - 1.0)
        columns = (signed, np.sign(signed), signed * np.abs(signed), np.ones(signed.size), rate, turned)
        openings = np.column_stack(columns)
        slips = np.column_stack([openings * s.toward[:, None], s.u, s.u * np.abs(signed)])
        driving = s.has_r & (np.abs(signed) > _DRIVES)
        return cls(seen.command[:, i], openings, (s.y - s.b) / (np.abs(s.b) + 0.1), slips, driving, s)

    def table(self, opening: Array, slip: Array) -> Array:
        """Relations, whether each is known, and where the wheel drives, shape (n, 13), by weights of opening and slip."""
        s = self.signals
        both, tracked = s.known & s.has_b, s.known & s.has_r
        columns = (
            self.slip * both,
            (self.opening - self.openings @ opening) * s.toward * s.has_r,
            (s.y - s.r) * tracked,
            (s.d - s.r) * s.has_r,
            (s.d - s.y) * s.known,
            (self.slip - self.slips @ slip) * both,
            *(both, s.has_r, tracked, s.has_r, s.known, both),
            self.driving,
        )
        return np.stack([np.asarray(c, np.float64) for c in columns], axis=1)


def deviations(i: int, blocks: WheelBlocks, seen: MissionSignals, at: Blocks) -> Deviations:
    """How far wheel i is from its usual self in frames at the blocks `at`."""
    opening, slip = _weights(i, blocks, seen, at)
    parts: list[list[Array]] = [[] for _ in WINDOWS]
    for part, signals, mine in _parts(blocks, seen, at):
        for k, w in enumerate(windowed(_Relations.of(i, part, signals).table(opening, slip), mine, blocks.dt)):
            parts[k].append(w)
    scaled, values, scales = [], [], np.zeros(RELATIONS)
    q = RELATIONS
    for k, pieces in enumerate(parts):
        w = np.concatenate(pieces)
        mean = np.where(w[:, q : 2 * q] > 0.2, w[:, :q] / np.maximum(w[:, q : 2 * q], 1e-9), np.nan)
        usual = np.array([shorth(mean[w[:, 2 * q] > 0.8, j]) for j in range(q)])
        scaled.append(np.arcsinh((mean - usual[:, 0]) / usual[:, 1]))
        values.append(mean)
        if k == MIDDLE:
            scales = usual[:, 1]
    return Deviations(tuple(scaled), tuple(values), scales)


def _parts(
    blocks: WheelBlocks, seen: MissionSignals, at: Blocks
) -> Iterator[tuple[WheelBlocks, MissionSignals, Blocks]]:
    n = len(blocks.y)
    for cut, mine in cuts(at, n, blocks.dt):
        yield (blocks if cut.stop - cut.start == n else blocks.part(cut.start, cut.stop)), seen.part(cut), mine


def _weights(i: int, blocks: WheelBlocks, seen: MissionSignals, at: Blocks) -> tuple[Array, Array]:
    """Weights of the regressors of opening and slip, fitted to some thousand blocks of the mission."""
    kept: list[list[Array]] = [[], [], [], []]
    step = max(1, len(blocks.y) // _MOST_ROWS // 2)
    for part, signals, _ in _parts(blocks, seen, at):
        found = _Relations.of(i, part, signals)
        drives = np.flatnonzero(found.driving)[::step]
        rolls = np.flatnonzero(found.driving & found.signals.known & found.signals.has_b)[::step]
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
    out = [*own.scaled]
    for k in _OF_OTHERS:
        stated = own.values[k][:, :_STATED]
        if others:
            z = np.nan_to_num(np.array([o.scaled[k] for o in others]))
            v = np.median(np.nan_to_num(np.array([o.values[k] for o in others])), axis=0)[:, :_STATED]
            top = np.take_along_axis(z, np.abs(z).argmax(axis=0)[None], axis=0)[0]
            out += [np.median(z, axis=0), top, v, np.nan_to_num(stated) - v]
        else:
            out.append(np.zeros((frames, 2 * (RELATIONS + _STATED))))
        out.append(stated)
    out.append(np.tile(np.log10(own.scales), (frames, 1)))
    return bounded(np.concatenate(out, axis=1))
