"""What the page draws: for each fault its wheel under all laws, and each wheel through the mission, thinned for the screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted
from diagnosis.results.fault_rows import state_label

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

MOST_FAULTS = 60
_POINTS = 500  # of a curve around a fault
_MISSION_POINTS = 900  # of one through the mission
_BEFORE_S, _AFTER_S = 2.0, 4.0


def page_plots(columns: Columns, abducted: Abducted, wheels: Sequence[str], laws: Sequence[str]) -> dict[str, Any]:
    """Curves by fault and by wheel.

    Parameters
    ----------
    columns : Mapping[str, NDArray[np.float64]]
        From `diagnosis.counterfactual.columns.world_columns`.
    abducted : Abducted
        The recorded mission.
    wheels, laws : Sequence[str]
        Names; of the laws without the recorded one.
    """
    dt, size = abducted.world.dt, len(abducted.world.y)
    views = []
    for fault in abducted.faults[:MOST_FAULTS]:
        f, wheel = fault.finding, wheels[fault.wheel]
        begin = max(0, f.start - round(_BEFORE_S / dt))
        end = min(size, f.stop + round(_AFTER_S / dt))
        label = (
            f"{wheel} {fault.side} {state_label(f.mode, fault.side).lower()}, {f.start * dt:.1f}–{f.stop * dt:.1f} s"
        )
        views.append(
            _view(columns, label, wheel, laws, slice(begin, end), _POINTS, dt) | {"fault": [f.start * dt, f.stop * dt]}
        )
    views += [
        _view(columns, f"{wheel}, whole mission", wheel, laws, slice(0, size), _MISSION_POINTS, dt) for wheel in wheels
    ]
    return {"laws": list(laws), "views": views}


def _view(
    columns: Columns, label: str, wheel: str, laws: Sequence[str], rows: slice, points: int, dt: float
) -> dict[str, Any]:
    """Speeds and commands of a wheel on some rows: means of a few neighbouring samples."""
    stride = max(1, -(-(rows.stop - rows.start) // points))

    def thin(name: str) -> list[float | None]:
        values = columns[name][rows]
        count = values.size // stride
        means = values[: count * stride].reshape(count, stride).mean(axis=1)
        return [None if not np.isfinite(x) else round(float(x), 4) for x in means]

    return {
        "label": label,
        "wheel": wheel,
        "start": rows.start * dt,
        "step": stride * dt,
        "samples": stride,
        "v_ref": thin(f"wheel.{wheel}.v_ref"),
        "read": thin(f"wheel.{wheel}.read"),
        "v": [thin(f"wheel.{wheel}.v"), *(thin(f"{law}.{wheel}.v") for law in laws)],
        "u": [thin(f"wheel.{wheel}.u"), *(thin(f"{law}.{wheel}.u") for law in laws)],
    }
