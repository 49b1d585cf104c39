"""How fast a component was commanded to go, from the columns of a result: for scores by excitation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from diagnosis.evaluation.counts import SPEED_BANDS
from diagnosis.evaluation.spans import Span

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Speeds:
    """Commanded speeds of the wheels.

    Attributes
    ----------
    t : Array, shape (n,)
        Mission time [s], uniform.
    by_wheel : Mapping[str, Array], each of shape (n,)
        |v_c,i| [m/s]; NaN where not known.
    """

    t: Array
    by_wheel: Mapping[str, Array]

    def of(self, component: str) -> Array:
        """|v_c,i| of a wheel, or the mean of all for anything else [m/s]; shape (n,)."""
        if component in self.by_wheel:
            return self.by_wheel[component]
        known = np.stack(list(self.by_wheel.values()))
        count = np.isfinite(known).sum(axis=0)
        return np.asarray(np.where(count > 0, np.nansum(known, axis=0) / np.maximum(count, 1), np.nan))

    def bands(self, component: str, shift: float) -> list[tuple[float, float, int]]:
        """Stretches in one of `SPEED_BANDS`: start and stop [s], later by `shift`, and the band's index."""
        speed = self.of(component)
        code = np.searchsorted([low for low, _ in SPEED_BANDS[1:]], speed, side="right")
        code = np.where(np.isfinite(speed), code, -1)
        cut = np.flatnonzero(np.r_[True, code[1:] != code[:-1]])
        edges = np.r_[self.t[cut], 2 * self.t[-1] - self.t[-2]] + shift
        return [(float(edges[i]), float(edges[i + 1]), int(code[k])) for i, k in enumerate(cut) if code[k] >= 0]

    def mean(self, component: str, spans: Sequence[Span], shift: float) -> float | None:
        """Mean |v_c,i| within spans [m/s], whose times are later by `shift`; None where nothing is known."""
        speed = self.of(component)
        places = [np.searchsorted(self.t, np.array(span) - shift) for span in spans]
        inside = np.concatenate([speed[a:b] for a, b in places]) if places else np.zeros(0)
        inside = inside[np.isfinite(inside)]
        return float(inside.mean()) if inside.size else None


def speeds_of(columns: Mapping[str, NDArray[np.floating]], wheels: Sequence[str]) -> Speeds | None:
    """Commanded speeds as recorded, else as replayed; None where the columns hold none.

    Parameters
    ----------
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Of a `MissionResult` or its ``report.parquet``.
    wheels : Sequence[str]
        Wheels of the machine.
    """
    found = {}
    for wheel in wheels:
        for name in (f"wheel.{wheel}.v_ref", f"replay.{wheel}.v_ref"):
            if name in columns and np.isfinite(columns[name]).any():
                found[wheel] = np.abs(columns[name].astype(np.float64))
                break
    if not found or "t" not in columns or len(columns["t"]) < 2:
        return None
    return Speeds(columns["t"].astype(np.float64), found)


def read_speeds(path: Path, wheels: Sequence[str]) -> Speeds | None:
    """Commanded speeds of a saved result; None where its ``report.parquet`` is absent or holds none."""
    try:
        names = pq.read_schema(path).names
        wanted = [n for n in names if n == "t" or n.endswith(".v_ref")]
        table = pq.read_table(path, columns=wanted)
    except (OSError, ValueError, pa.ArrowException):  # ValueError: names that are no text
        return None
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return speeds_of({name: v for name, v in columns.items() if v.dtype.kind in "fiu"}, wheels)
