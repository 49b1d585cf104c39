"""Whole faults once more by filterpy: every row of the tables stepped over a fault's readings, against no fault at all.

Slow on purpose: a Python loop over readings with filterpy's own filters (`diagnosis.estimation.row_filters`), for whoever wants
to check a verdict without the compiled recursions. Of a long fault evenly spaced readings are taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import GAIN, ROW_OF_MODEL
from diagnosis.estimation.row_filters import RowFilter, models_of
from diagnosis.estimation.second_onset import channel_model
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import ROWS, codes_of
from diagnosis.results.result import Epsilon, MissionResult
from diagnosis.results.vocabulary import Severity, Tier
from replay.faults import Side, State

Array = NDArray[np.float64]

_MOST = 1500  # readings of one fault
_LEAST = 8
_FLOOR = -18.0


@dataclass(frozen=True)
class Verified:
    """A fault as filterpy sees it.

    Attributes
    ----------
    id : str
        ``F1``.
    row : State or None
        Row with the most evidence; None where the readings show only that something departs from the expected speed, as with
        a valve behind a wheel model, or where `why` says that nothing was computed.
    gain : float
        Its log-evidence beside no fault; negative where healthy readings are likelier.
    epsilon : Epsilon or None
        ε̂ = 1 − δ̂ with 95 % bounds [1], where the row is the inefficient one.
    readings : int
        Readings taken.
    why : str
        Why nothing was computed; empty otherwise.
    """

    id: str
    row: State | None
    gain: float
    epsilon: Epsilon | None
    readings: int
    why: str = ""


def verified(result: MissionResult, each: Callable[[int, int], None] = lambda done, of: None) -> tuple[Verified, ...]:
    """Step filterpy over every fault of at least low severity.

    Parameters
    ----------
    result : MissionResult
        With its evidence columns.
    each : Callable[[int, int], None]
        Called after each fault with how many are done and how many there are.
    """
    faults = [f for f in result.report["intervals"] if f["severity"] != Severity.INFO]
    out = []
    for k, fault in enumerate(faults):
        out.append(_one(result, fault))
        each(k + 1, len(faults))
    return tuple(out)


def _one(result: MissionResult, fault: IntervalRow) -> Verified:
    none = Verified(fault["id"], None, 0.0, None, 0)
    found = _readings(result, fault)
    if isinstance(found, str):
        return Verified(fault["id"], None, 0.0, None, 0, found)
    y, x, noise, dt = found
    if y.size < _LEAST:
        return Verified(fault["id"], None, 0.0, None, y.size, "too few readings")
    model = channel_model(noise, y, x, dt)
    side = Side.ACTUATOR if fault["side"] == Side.ACTUATOR else Side.SENSOR
    floor = _FLOOR - float(np.log(model.span))
    evidence: dict[int, float] = {}
    epsilon = None
    for code in codes_of(side):
        for m in models_of(code):
            one = RowFilter(m, model)
            total = sum(max(one.step(float(a), float(b)), floor) for a, b in zip(y, x, strict=True))
            row = int(ROW_OF_MODEL[m])
            evidence[row] = max(evidence.get(row, -np.inf), total)
            if m == GAIN:
                delta, std = one.gain
                epsilon = Epsilon(1.0 - delta, 1.0 - delta - 1.96 * std, 1.0 - delta + 1.96 * std)
    best = max((r for r in evidence if r), key=lambda r: evidence[r])
    direct = fault["side"] != Side.ACTUATOR or fault["tier"] == Tier.DIRECT
    return Verified(
        none.id,
        ROWS[best] if direct else None,
        evidence[best] - evidence[0],
        epsilon if direct and ROWS[best] == State.INEFFICIENT else None,
        y.size,
    )


def _readings(result: MissionResult, fault: IntervalRow) -> tuple[Array, Array, float, float] | str:
    """Readings of a fault, what is expected of them, their noise and the step between them; or why there are none."""
    side = "actuator" if fault["side"] == Side.ACTUATOR else "sensor"
    names = [f"evidence.{fault['component']}.{side}.{leaf}" for leaf in ("residual", "expected", "threshold")]
    if any(name not in result.columns for name in names):
        return "its evidence is no comparison of readings with expected ones"
    if result.windows is not None:
        return "of so long a mission only envelopes are kept; diagnose the part with --start and --end"
    t = np.asarray(result.columns["t"], np.float64)
    first, last = np.searchsorted(t, [fault["start_s"], fault["stop_s"]])
    stride = max(1, -(-int(last - first) // _MOST))
    residual, x, threshold = (np.asarray(result.columns[n][first:last:stride], np.float64) for n in names)
    known = np.isfinite(residual) & np.isfinite(x)
    noise = float(np.nanmedian(threshold)) / 3.0 if np.isfinite(threshold).any() else 0.0
    if noise <= 0.0:
        return "no noise of healthy readings is known"
    return (residual + x)[known], x[known], noise, float(t[1] - t[0]) * stride
