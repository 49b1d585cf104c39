"""Rows of plots of the evidence on one side of a part: residual, probability that it deviates, ε̂, saturation term, modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.rows import Columns, Row, Trace
from diagnosis.report.units import natural_unit, on_page
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import DECIDED, TOTAL, Side, State

_FINEST = 500  # stretches of a mission that are told apart
_LIKELY = 0.5  # more probable than not
_TINTED_S = 0.5  # at the edges of faults it is briefly so


def residual_row(base: str, unit: str, scale: float, of: str = "") -> Row:
    """Residual within ± its threshold, of the evidence columns that begin with `base`.

    `scale` takes SI to the shown unit [1].
    """
    return Row(
        f"residual{of}",
        f"Residual{of}",
        unit,
        (Trace(base + "residual", "residual", "measured", scale),),
        threshold=base + "threshold",
        band_scale=scale,
    )


def probability_row(
    base: str, limit: float | None, columns: Columns, of: str = "", limits: tuple[float, float] = (-0.03, 1.03)
) -> Row:
    """Probability that a side deviates, also by less than counts as a fault, and the limit from which a fault is stated.

    Limits are probabilities [1].
    """
    return Row(
        f"probability{of}",
        f"Probability that it deviates{of}",
        "1",
        (Trace(base + "probability", "at all, also by less than counts as a fault", "measured"),),
        level=limit,
        limits=limits,
        unknown=unknown_stretches(base + "probability", columns),
        small=small_stretches(base, columns),
        untold=untold_stretches(base, columns),
    )


def unknown_stretches(column: str, columns: Columns) -> tuple[tuple[float, float], ...]:
    """First and last time [s] of the stretches in which a column has no value; those that nearly touch are one."""
    return _stretches(columns["t"], ~np.isfinite(columns[column])) if {column, "t"} <= columns.keys() else ()


def small_stretches(base: str, columns: Columns) -> tuple[tuple[float, float], ...]:
    """Stretches [s] in which a part deviates more probably than not, by so little that it was called healthy."""
    return _deviating(base, columns, total=False)


def untold_stretches(base: str, columns: Columns) -> tuple[tuple[float, float], ...]:
    """Stretches [s] in which a part is most probably stuck or without signal, though no fault is stated: nothing says that it deviates by little."""
    return _deviating(base, columns, total=True)


def _deviating(base: str, columns: Columns, *, total: bool) -> tuple[tuple[float, float], ...]:
    """Stretches [s] of a part that was called healthy and deviates more probably than not, by a row of which nothing is left or another one."""
    names = (base + "probability", base + "epsilon")
    if not {*names, "t"} <= columns.keys():
        return ()
    chance = columns[names[0]]
    flags = (chance > _LIKELY) & (columns[names[1]] == 0.0)
    at = np.flatnonzero(flags)
    modes = (columns[name] for m in TOTAL if (name := base + f"p_{m}") in columns)
    lost = sum((np.nan_to_num(p[at]) for p in modes), np.zeros(at.size))
    flags[at] = (lost > _LIKELY * chance[at]) == total
    found = _stretches(columns["t"], flags)
    return tuple((start, stop) for start, stop in found if stop - start >= _TINTED_S)


def _stretches(times: NDArray[np.floating], flags: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """First and last time [s] of the stretches in which flags of shape (n,) are set; those that nearly touch are one."""
    t = np.asarray(times, np.float64)
    cut = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    if not cut.size:
        return ()
    step = float(t[-1] - t[0]) / max(1, t.size - 1)
    starts, stops = t[cut[::2]], t[cut[1::2] - 1] + step
    apart = np.flatnonzero(starts[1:] - stops[:-1] > max(step, float(t[-1] - t[0]) / _FINEST))
    first, last = starts[np.r_[0, apart + 1]].tolist(), stops[np.r_[apart, -1]].tolist()
    return tuple((round(a, 4), round(b, 4)) for a, b in zip(first, last, strict=True))


def side_rows(
    fault: IntervalRow,
    side: Side,
    columns: Columns,
    residual_unit: tuple[str, float],
    limit: float | None,
    words: MachineWords,
) -> list[Row]:
    """Residual, probability that the side deviates, ε̂, saturation term and mode probabilities of one side.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    side : Side
        Of its part.
    columns : Columns
        Columns with those of `diagnosis.report.rows.derived`.
    residual_unit : tuple[str, float]
        Unit of the residual, and what takes SI to it [1].
    limit : float or None
        Probability from which a fault is stated.
    words : MachineWords
        How to speak of the machine.
    """
    base = f"evidence.{fault['component']}.{side}."
    of = f" ({side})" if fault["side"] == Side.SENSOR_OR_ACTUATOR else ""
    sat_unit, sat_scale = on_page(natural_unit(Kind(fault["kind"]), side, words), words)
    return [
        residual_row(base, *residual_unit, of),
        probability_row(base, limit, columns, of),
        Row(
            f"epsilon{of}",
            f"Loss of effectiveness ε̂{of}",
            "1",
            (Trace(base + "epsilon", "of the fault as stated, 95 % band; 0 where healthy", "measured"),),
            band=(base + "epsilon_low", base + "epsilon_high"),
            clip=(_lowest(columns.get(base + "epsilon")), 2.0),
            unknown=unknown_stretches(base + "epsilon", columns),
            steps=True,
        ),
        Row(
            f"sat{of}",
            f"Saturation term sat{of}",
            sat_unit,
            (Trace(base + "sat", "mean of the fault as stated, 95 % band", "measured", sat_scale),),
            band=(base + "sat_low", base + "sat_high"),
            band_scale=sat_scale,
            steps=True,
        ),
        *_mode_row(fault, side, base, of, columns, words),
    ]


def _lowest(epsilon: NDArray[np.floating] | None) -> float:
    """Where the axis of ε̂ ends: low enough for every loss that is stated; a part that gives more than it should has a negative one [1]."""
    known = np.empty(0) if epsilon is None else epsilon
    least = float(np.fmin.reduce(known, initial=0.0))  # NaN is passed over
    return min(-1.0, 1.1 * (least if np.isfinite(least) else float(known[np.isfinite(known)].min(initial=0.0))))


def _mode_row(fault: IntervalRow, side: Side, base: str, of: str, columns: Columns, words: MachineWords) -> list[Row]:
    """Mode probabilities of one side; only once, and of both, where the evidence does not tell the sides apart.

    That a side is healthy does not say that nothing is faulty where the other side may be: its curve says so.
    """
    both = any(h["side"] == Side.SENSOR_OR_ACTUATOR for h in fault["hypotheses"])
    if both and side is Side.ACTUATOR:
        return []
    other = Side.ACTUATOR if side is Side.SENSOR else Side.SENSOR
    elsewhere = any(h["side"] == other and h["mode"] != State.HEALTHY for h in fault["hypotheses"])
    healthy = state_label(State.HEALTHY, side).lower()
    if elsewhere:
        own, rest = (words.part_name(fault["kind"], s) for s in (side, other))
        healthy = f"{own} healthy: {rest} faulty, or neither"
    whole = ", of the fault as a whole" if _as_a_whole(base, columns) else ""
    return [
        Row(
            f"modes{of}",
            f"Mode probability{whole}{' (of either part)' if both else of}",
            "1",
            tuple(
                Trace(f"{base}p_{m}", healthy if m is State.HEALTHY else state_label(m, side).lower(), f"mode-{m}")
                for m in DECIDED
            ),
            limits=(-0.03, 1.03),
            steps=bool(whole),
        )
    ]


def _as_a_whole(base: str, columns: Columns) -> bool:
    """Whether the rows were weighed by whole faults: outside of them their probabilities are not known."""
    column = columns.get(base + "p_healthy")
    return column is not None and not bool(np.isfinite(column).all())
