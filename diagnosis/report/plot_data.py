"""What the page's scripts need: encoded columns with their units, faults and the rows of every figure."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import orjson

from diagnosis.pages import labels
from diagnosis.report.budget import Encodable, encode
from diagnosis.report.compared_channels import by_effort
from diagnosis.report.encode import Channel, Segment
from diagnosis.report.plot_rows import fault_rows
from diagnosis.report.rows import Columns, Group, Row, row_json
from diagnosis.report.tables import machine_name
from diagnosis.report.units import units_of
from diagnosis.results.candidates import candidates_of, label_of
from diagnosis.results.document import IntervalRow, MachineRow, ReportDocument
from diagnosis.results.fault_rows import LOOKS, state_label
from diagnosis.results.machine_words import words_of
from diagnosis.results.result import Closeups
from diagnosis.results.vocabulary import Kind, Severity
from replay.faults import DECIDED, Side

_OTHERS = 0.1
_LEAST = 50_000


@dataclass(frozen=True)
class Axis:
    """Time axis of the columns.

    Attributes
    ----------
    start, step : float
        Time of the first row and between rows [s].
    rows : int
        Number of rows; 0 where there is no axis.
    per : int
        Samples whose extremes two rows hold; 1 where each row is a sample.
    """

    start: float
    step: float
    rows: int
    per: int = 1

    @property
    def sample_s(self) -> float:
        """Time between samples [s]."""
        return self.step if self.per == 1 else 2 * self.step / self.per

    @property
    def samples(self) -> int:
        """Samples of the mission."""
        return self.rows if self.per == 1 else self.rows // 2 * self.per


def axis_of(columns: Columns, rate: float) -> Axis:
    """Time axis of some columns.

    Parameters
    ----------
    columns : Columns
        Columns with ``t`` [s].
    rate : float
        Sample rate of the mission [Hz]: rows much farther apart than samples are extremes of several.

    Raises
    ------
    ValueError
        Where the columns differ in length or ``t`` is not uniform.
    """
    t = columns.get("t")
    if t is None or len(t) < 2:
        return Axis(0.0, 1.0, 0)
    if (wrong := next((k for k, v in columns.items() if v.shape != t.shape), None)) is not None:
        raise ValueError(f"column {wrong!r} has shape {columns[wrong].shape}, but t has {t.shape}")
    step = float(t[-1] - t[0]) / (len(t) - 1) if np.isfinite(t).all() else 0.0
    if not 0 < step < np.inf or np.abs(t - (t[0] + step * np.arange(len(t)))).max() > 0.5 * step:
        raise ValueError("column 't' is not uniform; resample the columns first")
    samples = step * rate
    return Axis(float(t[0]), step, len(t), round(2 * samples) if samples > 1.5 else 1)


def worst(faults: Sequence[IntervalRow], count: int) -> list[IntervalRow]:
    """The most severe faults, at most so many, in the order given."""
    if len(faults) <= count:
        return list(faults)
    order = sorted(range(len(faults)), key=lambda i: -Severity(faults[i]["severity"]).rank)
    return [faults[i] for i in sorted(order[:count])]


def figures_of(
    faults: Sequence[IntervalRow], machine: MachineRow, columns: Columns, limit: float | None
) -> dict[str, tuple[Row, ...]]:
    """Rows of each fault's figure; those of faults of one part are the same object.

    Columns of shape (n,), SI; `limit` is a probability [1].
    """
    known: dict[tuple[str, ...], tuple[Row, ...]] = {}
    out = {}
    for f in faults:
        shown = by_effort(f, columns), f["sat"]["unit"] if f["sat"] else ""
        key = (f["component"], f["kind"], f["side"], f["tier"], *shown)
        if key not in known:
            peers = machine["axles"] if f["kind"] == Kind.STEER else machine["wheels"]
            known[key] = fault_rows(f, peers, columns, words_of(machine), limit)
        out[f["id"]] = known[key]
    return out


def channels_of(
    report: ReportDocument,
    columns: Columns,
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: Axis,
    budget: int,
    closeups: Closeups | None = None,
) -> list[Channel]:
    """Encode all columns: those that a figure shows first, the others with what is left of the budget [bytes]."""
    rows = [r for group in {id(g): g for g in figures.values()}.values() for r in group]
    rows += [r for g in groups for r in g.rows]
    used = dict.fromkeys(c for r in rows for c in r.columns())
    others = [c for c in columns if c not in used and c != "t"]
    lsb = {s["name"]: s["lsb"] for s in report["signals"] if s["lsb"]}
    faults = [
        (
            f["start_s"] - axis.start,
            f["stop_s"] - axis.start,
            frozenset(c for r in figures[f["id"]] for c in r.columns()),
        )
        for f in sorted(report["intervals"], key=lambda f: -Severity(f["severity"]).rank)
    ]
    near = closeups if axis.per > 1 else None
    first = int((1 - _OTHERS) * budget) if others else budget
    shown = encode(Encodable({c: columns[c] for c in used}, lsb, faults, axis.sample_s, axis.per, near), first)
    left = max(budget - sum({id(s): len(s.text) for c in shown for s in c.segments}.values()), _LEAST)
    return shown + encode(Encodable({c: columns[c] for c in others}, lsb, [], axis.sample_s, axis.per), left)


def packed_intervals(faults: Sequence[IntervalRow]) -> str:
    """All faults as JSON by their names, deflated, in base64."""
    return base64.b64encode(zlib.compress(orjson.dumps({f["id"]: f for f in faults}), 6)).decode("ascii")


def blocks_of(channels: Sequence[Channel]) -> list[Segment]:
    """The segments of all channels, those that several channels share once."""
    return list({id(s): s for c in channels for s in c.segments}.values())


def view(
    report: ReportDocument,
    channels: Sequence[Channel],
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: Axis,
    duration: float,
) -> dict[str, object]:
    """What the page's scripts need to know, as JSON; a segment's last number is its place among `blocks_of`.

    `duration` in s.
    """
    block = {id(s): i for i, s in enumerate(blocks_of(channels))}
    index = {c.name: i for i, c in enumerate(channels)}
    distinct = {id(rows): rows for rows in figures.values()}
    place = {key: i for i, key in enumerate(distinct)}
    words = words_of(report["machine"])
    faults = [
        {
            "id": f["id"],
            "start": f["start_s"],
            "stop": f["stop_s"],
            "detected": f["detected_s"],
            "mode": f["mode"],
            "component": f["component"],
            "side": f["side"],
            "p": round(f["probability"], 3),
            "words": label_of(f).lower(),
            "unclear": bool(candidates_of(f)),
            "severity": f["severity"],
            "title": labels.fault_title(f, words),
            "rows": place[id(figures[f["id"]])],
        }
        for f in report["intervals"]
    ]
    units = units_of([c.name for c in channels], report, figures, groups)
    return {
        "t0": axis.start,
        "dt": axis.sample_s,
        "n": axis.samples,
        "closeups": any(len(c.segments) > 1 for c in channels),
        "duration": duration,
        "name": machine_name(report["machine"]),
        "faults": faults,
        "limit": report["limits"]["min_probability"],
        "words": {
            side.value: {m: state_label(m, side).lower() for m in DECIDED} for side in (Side.SENSOR, Side.ACTUATOR)
        },
        "dashes": {state: look.dash for state, look in LOOKS.items() if look.dash != "solid"},
        "figures": [[row_json(r, index) for r in rows] for rows in distinct.values()],
        "loop": [{"key": g.key, "title": g.title, "rows": [row_json(r, index) for r in g.rows]} for g in groups],
        "channels": [
            {
                "name": c.name,
                "unit": unit,
                "k": k,
                "step": c.step,
                "base": c.base,
                "segments": [[s.start, s.count, s.stride, s.planes, block[id(s)]] for s in c.segments],
            }
            for c, (unit, k) in zip(channels, units, strict=True)
        ],
    }
