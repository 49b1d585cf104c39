"""The one course of ε̂ and of the saturation term that a result has: of each stated fault its size, of health none.

What plots, tables and files show of a size is that of the fault as it is stated. Outside of faults a part that was judged healthy has
ε̂ = 0; where nothing was decided, or the fault's size is not known, there is none.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import IntervalRow, ReportDocument
from replay.faults import DECIDED, Side, State
from replay.machine.quantities import OPENING

Array = NDArray[np.float32]

_OF_COMMANDS = (OPENING, "fraction")
#: Leaves of evidence columns: ε̂ with its 95 % bounds, and the saturation term with its own.
EPSILON = ("epsilon", "epsilon_low", "epsilon_high")
SAT = ("sat", "sat_low", "sat_high")

_EVEN = 0.5  # columns that show a fault as less probable than that, or than it is stated, rest on other evidence than it does


def size_columns(
    report: ReportDocument, t: NDArray[np.floating], step: float, parts: frozenset[tuple[str, str]]
) -> dict[str, Array]:
    """Columns ``evidence.<component>.<side>.<leaf>`` of `EPSILON` and `SAT`; those without any value are left out.

    Parameters
    ----------
    report : ReportDocument
        The document, with its ``intervals`` and ``states``.
    t : NDArray[np.floating], shape (n,)
        Times that are wanted, increasing [s].
    step : float
        Time between samples [s].
    parts : frozenset[tuple[str, str]]
        Components and sides that are wanted.

    Returns
    -------
    dict[str, Array], each of shape (n,)
        ε̂ [1]; saturation terms in the unit that the fault gives.
    """
    spans: dict[tuple[str, str], list[tuple[float, float]]] = {part: [] for part in sorted(parts)}
    for s in report["states"]:
        if s["state"] == State.HEALTHY and (s["component"], s["side"]) in spans:
            spans[s["component"], s["side"]].append((s["start_s"], s["stop_s"]))
    out: dict[str, Array] = {}
    for (component, side), healthy in spans.items():
        columns = {leaf: np.full(t.size, np.nan, np.float32) for leaf in (*EPSILON, *SAT)}
        for start, stop in healthy:
            columns["epsilon"][_rows(t, step, start, stop)] = 0.0
        mine = [f for f in report["intervals"] if f["component"] == component and side in Side(f["side"]).sides]
        for fault in sorted(mine, key=lambda f: f["probability"]):
            rows = _rows(t, step, fault["start_s"], fault["stop_s"])
            for leaf, value in _sizes(fault, Side(side)).items():
                columns[leaf][rows] = value
        base = f"evidence.{component}.{side}."
        out |= {base + leaf: x for leaf, x in columns.items() if np.isfinite(x).any()}
    return out


def mode_columns(
    report: ReportDocument, t: NDArray[np.floating], step: float, parts: frozenset[tuple[str, str]]
) -> dict[str, Array]:
    """Columns ``evidence.<component>.<side>.p_<mode>`` of parts that were weighed by whole stretches, as the decision has them.

    During a fault each row has the probability that the fault's hypotheses give it on that side, and health what they leave;
    outside of faults there is none. What may be either side's counts on both. Rows that are nowhere probable are left out. Arguments as for `size_columns`.

    Returns
    -------
    dict[str, Array], each of shape (n,)
        Probabilities [1].
    """
    out: dict[str, Array] = {}
    for component, side in sorted(parts):
        columns = {mode: np.full(t.size, np.nan, np.float32) for mode in DECIDED}
        mine = [f for f in report["intervals"] if f["component"] == component and side in Side(f["side"]).sides]
        for fault in sorted((f for f in mine if f["hypotheses"]), key=lambda f: f["probability"]):
            rows = _rows(t, step, fault["start_s"], fault["stop_s"])
            for mode, p in _chances(fault, side).items():
                columns[mode][rows] = p
        base = f"evidence.{component}.{side}.p_"
        out |= {base + mode: x for mode, x in columns.items() if np.any(x > 0.0)}
    return out


def _chances(fault: IntervalRow, side: str) -> dict[State, float]:
    """Probability that a fault's hypotheses give each row on one side, and health what they leave."""
    chances = dict.fromkeys(DECIDED, 0.0)
    for h in fault["hypotheses"]:
        if h["mode"] != State.HEALTHY and side in Side(h["side"]).sides:
            chances[State(h["mode"])] += h["p"]
    chances[State.HEALTHY] = max(0.0, 1.0 - sum(chances.values()))
    return chances


def known_modes(
    report: ReportDocument, t: NDArray[np.floating], step: float, columns: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """The columns ``evidence.<component>.<side>.p_<mode>`` that change where a fault rests on other evidence than theirs, which call it improbable.

    During such a fault they are what its hypotheses say, as those of `mode_columns`.

    Columns and `t` [s] of shape (n,).
    """
    out: dict[str, NDArray[Any]] = {}
    for component, side in {(s["component"], s["side"]): None for s in report["states"]}:
        base = f"evidence.{component}.{side}.p_"
        healthy = columns.get(base + State.HEALTHY)
        mine = [f for f in report["intervals"] if f["component"] == component and side in Side(f["side"]).sides]
        for fault in sorted((f for f in mine if f["hypotheses"]), key=lambda f: f["probability"]):
            rows, chances = _rows(t, step, fault["start_s"], fault["stop_s"]), _chances(fault, side)
            if healthy is None or not healthy[rows].size:
                continue
            if _least_half(1.0 - np.nan_to_num(healthy[rows], nan=1.0)) >= min(_EVEN, 1.0 - chances[State.HEALTHY]):
                continue
            for mode, p in chances.items():
                name = base + mode
                if p > 0.0 or name in columns:
                    kept = columns.get(name, np.full(t.size, np.nan, healthy.dtype))
                    out.setdefault(name, kept.copy())[rows] = p
    return out


def known_probability(
    report: ReportDocument, t: NDArray[np.floating], step: float, columns: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """The columns ``evidence.<component>.<side>.probability`` without what was not decided, which is NaN; see `size_columns`.

    A fault that shows in stretches has none between them, where nothing was decided either. A fault of either side, which may rest on other
    evidence than these columns, has half of its probability on each at least; one that these columns call improbable rests on other evidence as
    well, and has its own.

    Columns and `t` [s] of shape (n,).
    """
    out = {}
    for component, side in {(s["component"], s["side"]): None for s in report["states"]}:
        name = f"evidence.{component}.{side}.probability"
        if name not in columns:
            continue
        known, values = np.zeros(t.size, np.bool_), columns[name].copy()
        for s in report["states"]:
            if (s["component"], s["side"]) == (component, side) and s["state"] in DECIDED:
                known[_rows(t, step, s["start_s"], s["stop_s"])] = True
        decided, drawn = known.copy(), columns[name]
        mine = [f for f in report["intervals"] if f["component"] == component and side in Side(f["side"]).sides]
        spans = [_rows(t, step, f["start_s"], f["stop_s"]) for f in mine]
        claims = np.zeros(t.size, np.uint16)
        for rows in spans:
            claims[rows] += 1
        for fault, rows in zip(mine, spans, strict=True):
            told = decided[rows] if decided[rows].any() else np.ones_like(decided[rows])  # by no state of this side
            known[rows] |= told
            faulty = 1.0 - sum(h["p"] for h in fault["hypotheses"] if h["mode"] == State.HEALTHY)
            own = told & (claims[rows] == 1)  # what another fault shows meanwhile is no picture of this one
            if fault["side"] == Side.SENSOR_OR_ACTUATOR:
                values[rows] = np.fmax(values[rows], 0.5 * faulty)
            elif min(_least_half(np.nan_to_num(drawn[rows][x])) for x in (told, own) if x.any()) < min(_EVEN, faulty):
                values[rows] = np.fmax(values[rows], faulty)
        out[name] = np.where(known, values, values.dtype.type(np.nan))
    return out


def _least_half(x: NDArray[np.floating]) -> float:
    """Mean of some values, or of their later half, whichever is less: what shows at its beginning alone rests on other evidence, too."""
    return float(min(np.mean(x), np.mean(x[x.size // 2 :])))


def _rows(t: NDArray[np.floating], step: float, start: float, stop: float) -> slice:
    """Samples from `start` to before `stop`, whatever their last digit."""
    return slice(*np.searchsorted(t, (start - 0.5 * step, stop - 0.5 * step)).tolist())


def _sizes(fault: Mapping[str, Any], side: Side) -> dict[str, float]:
    """Sizes of a fault by leaf; NaN where they are not known, or of the other side."""
    epsilon, sat = fault["epsilon"], fault["sat"]
    known = sat is not None and (sat["unit"] in _OF_COMMANDS) == (side is Side.ACTUATOR)
    sizes = [epsilon[k] for k in ("value", "low", "high")] if epsilon else [np.nan] * 3
    terms = [sat[k] for k in ("mean", "low", "high")] if known else [np.nan] * 3
    return dict(zip((*EPSILON, *SAT), (*sizes, *terms), strict=True))
