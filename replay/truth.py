"""Truth files: what was injected into a simulated or recorded log, for `evaluate` alone."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import orjson

from replay.atomic_write import atomic_path
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side

SCHEMA = "mfhca-truth/1"


@dataclass(frozen=True)
class TruthInterval:
    """One injected fault.

    Attributes
    ----------
    component, kind : str
        Wheel or steering axle; ``wheel`` or ``steer``.
    side, mode : Side, FaultMode
        Row of the paper's tables.
    start_s, stop_s : float
        Mission time [s], half open.
    epsilon : float
        ε of L4 or L8.
    sat_mean, sat_std : float
        Saturation term: m/s, rad or valve fraction; for a stuck part the value it was stuck at.
    ramp_s : float
        Time from `start_s` on over which ε grew linearly from 0 to `epsilon` [s]; 0 for at once, then left out of files.
    """

    component: str
    kind: str
    side: Side
    mode: FaultMode
    start_s: float
    stop_s: float
    epsilon: float
    sat_mean: float
    sat_std: float
    ramp_s: float = 0.0

    @classmethod
    def of(cls, fault: FaultSpec, kind: str, sat_mean: float, length_s: float) -> TruthInterval:
        """What was injected into a mission of some length for a fault, with the saturation term that was drawn.

        `sat_mean` in the channel's unit, `length_s` in s.
        """
        return cls(
            fault.component,
            kind,
            fault.side,
            fault.mode,
            fault.start_s,
            min(fault.stop_s, length_s),
            fault.epsilon,
            sat_mean,
            fault.sat_std,
            fault.ramp_s,
        )


@dataclass(frozen=True)
class TruthSpan:
    """A stretch of one component [s], half open."""

    component: str
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class MissionTruth:
    """Contents of a truth file.

    Attributes
    ----------
    wheels : tuple[str, ...]
        Drive wheels.
    rate_hz, start_ns, duration_s : float, int, float
        Recorded rate [Hz], first stamp [ns since 1970], length [s].
    driving_speed : float
        |true v_c,i| above which a wheel drives [m/s].
    intervals : tuple[TruthInterval, ...]
        Injected faults by start.
    slip, masked, driving : tuple[TruthSpan, ...]
        Tyre slip; actuators that cannot be judged because their sensor is stuck or silent; driving.
    open_loop : bool
        Whether the faults were written into a finished log, so that the controller never met them.
    """

    wheels: tuple[str, ...]
    rate_hz: float
    start_ns: int
    duration_s: float
    driving_speed: float = 0.05
    intervals: tuple[TruthInterval, ...] = ()
    slip: tuple[TruthSpan, ...] = ()
    masked: tuple[TruthSpan, ...] = ()
    open_loop: bool = False
    driving: tuple[TruthSpan, ...] = ()


def _plain(value: Any) -> Any:
    """JSON value of a field; floats to nine decimals so that files are short and stable."""
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    if isinstance(value, TruthInterval | TruthSpan):
        row = {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
        return {key: x for key, x in row.items() if key != "ramp_s" or x}
    return round(value, 9) if isinstance(value, float) else value


def truth_path(log: Path, *, folder: bool) -> Path:
    """``<stem>.truth.json`` beside a log; a compressed table loses both endings, a folder none."""
    stem = log.name if folder else log.name.removesuffix(".gz").rsplit(".", 1)[0]
    return log.with_name(f"{stem or log.name}.truth.json")


def write_truth(truth: MissionTruth, path: Path) -> None:
    """Write a truth file.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    document = {"schema": SCHEMA} | {f.name: _plain(getattr(truth, f.name)) for f in fields(truth)}
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n".join("    " + json.dumps(row, allow_nan=False) for row in value)
            lines.append(f"  {json.dumps(key)}: [\n{rows}\n  ]")
        else:
            lines.append(f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}")
    with atomic_path(path) as temporary:
        temporary.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def read_truth(path: Path) -> MissionTruth:
    """Read a truth file.

    Raises
    ------
    ConfigError
        Where the file is absent, is no truth file, or a part of it is missing or of the wrong kind.
    """
    try:
        document = orjson.loads(path.read_bytes())
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); give the truth file of this mission") from error
    except ValueError as error:
        raise ConfigError(f"{path}: is not JSON ({error}); expected a truth file with schema {SCHEMA}") from error
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise ConfigError(f"{path}: schema is {schema!r:.80}; expected {SCHEMA!r}")
    try:
        return MissionTruth(
            wheels=tuple(str(w) for w in document["wheels"]),
            rate_hz=float(document["rate_hz"]),
            start_ns=int(document["start_ns"]),
            duration_s=float(document["duration_s"]),
            driving_speed=float(document.get("driving_speed", 0.05)),
            intervals=tuple(_interval(row) for row in document["intervals"]),
            slip=_spans(document, "slip"),
            masked=_spans(document, "masked"),
            open_loop=bool(document.get("open_loop", False)),
            driving=_spans(document, "driving"),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ConfigError(
            f"{path}: is not a complete truth file ({error!r:.200}); expected the fields of {SCHEMA}"
        ) from error


def _interval(row: Mapping[str, Any]) -> TruthInterval:
    return TruthInterval(
        component=str(row["component"]),
        kind=str(row["kind"]),
        side=Side(row["side"]),
        mode=FaultMode(row["mode"]),
        start_s=float(row["start_s"]),
        stop_s=float(row["stop_s"]),
        epsilon=float(row["epsilon"]),
        sat_mean=float(row["sat_mean"]),
        sat_std=float(row["sat_std"]),
        ramp_s=float(row.get("ramp_s", 0.0)),
    )


def _spans(document: Mapping[str, Any], key: str) -> tuple[TruthSpan, ...]:
    return tuple(
        TruthSpan(str(row["component"]), float(row["start_s"]), float(row["stop_s"])) for row in document.get(key, ())
    )
