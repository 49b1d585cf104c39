"""Statements of a fault's plots that cannot be true beside its table: ε̂ and its band, the probability, states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def _rows(columns: Mapping[str, NDArray[Any]], start: float, stop: float) -> NDArray[np.bool_]:
    """Samples between two times, whatever their last digit."""
    t = columns["t"]
    spare = 0.5 * float(t[1] - t[0])
    return np.asarray((t >= start - spare) & (t < stop - spare))


def _sides(fault: Mapping[str, Any]) -> tuple[str, ...]:
    return ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)


def of_faults(
    fault: Mapping[str, Any], report: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]
) -> Iterator[str]:
    """What the plots of a fault show during it, against the finding: ε̂, its band, the probability of a fault."""
    for side in _sides(fault) if "t" in columns else ():
        base, inside = (
            f"evidence.{fault['component']}.{side}.",
            _rows(columns, fault["start_s"], fault["stop_s"]),
        )
        for other in report["intervals"]:
            if other["component"] == fault["component"] and side in _sides(other) and other["id"] != fault["id"]:
                inside &= ~_rows(columns, other["start_s"], other["stop_s"])
        whole = np.count_nonzero(_rows(columns, fault["start_s"], fault["stop_s"]))
        little = np.count_nonzero(inside) < 0.1 * whole  # left beside other faults: no picture of this one
        if little or not inside.any() or not any(name.startswith(base) for name in columns):
            continue
        for leaf, key in (("epsilon", "value"), ("epsilon_low", "low"), ("epsilon_high", "high")):
            said = np.nan if fault["epsilon"] is None else fault["epsilon"][key]
            drawn = columns.get(base + leaf, np.full(inside.size, np.nan))[inside]
            if not np.allclose(drawn, said, atol=1e-3, equal_nan=True):
                yield f"its plot shows {leaf} from {np.nanmin(drawn):.2f} to {np.nanmax(drawn):.2f}, its table {said:.2f}"
        chance = columns.get(base + "probability")
        # an onset is where a channel began to hold, which shows only later: in its second half, or from its detection on, where that is told
        middle = 0.5 * (fault["start_s"] + fault["stop_s"])
        means = []
        # of one in several stretches each begins so, and its words say what lies between them
        parted = any(" stretches (" in text for text in fault["evidence"])
        for seen in (middle, max(middle, fault["detected_s"] or 0.0), *([fault["start_s"]] if parted else [])):
            late = inside & _rows(columns, seen, fault["stop_s"])
            if chance is not None and fault["severity"] != "info" and np.isfinite(chance[late]).any():
                both = [
                    columns.get(f"evidence.{fault['component']}.{s}.probability", chance)[late] for s in _sides(fault)
                ]
                # what may be either's is divided
                means.append(float(np.nansum([np.nanmean(x) for x in both if np.isfinite(x).any()])))
        if means and max(means) < 0.5:
            yield f"its plot shows it not healthy with {max(means):.2f} on average"
        modes = columns.get(base + "p_healthy")
        late = inside & _rows(columns, max(middle, fault["detected_s"] or 0.0), fault["stop_s"])
        if (
            modes is not None
            and fault["severity"] != "info"
            and fault["side"] == side
            and np.isfinite(modes[late]).any()
        ):
            sound = min(float(np.nanmean(modes[x])) for x in (inside, late) if np.isfinite(modes[x]).any())
            if sound > 0.5:
                yield f"its plot of modes shows it healthy with {sound:.2f} on average"


def of_states(report: Mapping[str, Any], columns: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    """A loss of effectiveness, or a sure fault, in plots of a part while it is called healthy or is not judged."""
    for s in report["states"] if "t" in columns else ():
        base, rows = f"evidence.{s['component']}.{s['side']}.", _rows(columns, s["start_s"], s["stop_s"])
        for f in report["intervals"]:
            if f["component"] == s["component"] and s["side"] in _sides(f):
                rows &= ~_rows(columns, f["start_s"], f["stop_s"])
        chance = columns.get(base + "probability")
        undecided = ("not_excited", "masked", "slip", "no_data", "not_assessed")
        if chance is not None and s["state"] in undecided and np.isfinite(chance[rows]).any():
            yield f"{s['component']} {s['side']} is {s['state']} from {s['start_s']:.1f} s on, its plot shows a probability"
        loss = columns.get(base + "epsilon")
        if loss is None or not rows.any():
            continue
        if s["state"] == "healthy" and (loss[rows] != 0.0).any():
            yield f"{s['component']} {s['side']} is healthy from {s['start_s']:.1f} s on, its plot shows ε̂ {np.nanmax(loss[rows]):.2f}"
        if s["state"] != "healthy" and np.isfinite(loss[rows]).any():
            yield f"{s['component']} {s['side']} is {s['state']} from {s['start_s']:.1f} s on, its plot shows ε̂ {np.nanmax(loss[rows]):.2f}"
