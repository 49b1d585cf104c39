"""Audit stores made by SQL: single missions in visible lines, and whole made-up fleets."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from diagnosis.audit.store.database import Database
from diagnosis.audit.store.folders import mark_report
from diagnosis.audit.store.keys import Key

WHEELS, AXLES = ("FR", "FL", "RR", "RL"), ("front", "rear")
START_NS, DAY_NS = 1_793_000_000 * 10**9, 86_400 * 10**9
PARTS = tuple((c, s) for c in (*WHEELS, *AXLES) for s in ("sensor", "actuator"))
HOSTILE = (
    "=cmd|' /C calc'!A0",
    '<script>alert(1)</script><img src=x onerror="alert(1)">',
    "../../up & \"over\" 'there'#1?q=%41",
    "\u202egnp.exe\x07",
    "javascript:alert(1)//",
)


@dataclass(frozen=True)
class Fault:
    """One row of ``fault``."""

    component: str = "RL"
    side: str = "actuator"
    mode: str = "inefficient"
    severity: str = "medium"
    epsilon: tuple[float, float, float] | None = None
    seconds: float = 10.0


@dataclass(frozen=True)
class Sample:
    """A mission with its result; `left_out`: its log lacks nothing but whole files; `epsilon` by part, parts in `blind` are not assessed. `state` None: not audited yet.

    Without a machine, one that was not judged has its folder's name, as an audit gives it.
    """

    name: str
    machine: str = "HX-1"
    day: float | None = 0.0
    state: str | None = "ok"
    verdict: str | None = "ready"
    faults: Sequence[Fault] = ()
    epsilon: dict[tuple[str, str], tuple[float, float, float]] = field(default_factory=dict)
    blind: Sequence[tuple[str, str]] = ()
    driving_s: float = 1800.0
    reason: str = ""
    parts: Sequence[tuple[str, str]] = PARTS
    machine_name: str = "Boom lift"
    copies: Sequence[str] = ()
    gone: bool = False
    relative: bool = False
    left_out: bool = False


def write_store(path: Path, samples: Iterable[Sample]) -> Path:
    """Make a store of these missions, and folders for their reports, marked as theirs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with closing(Database(path)) as db, db.transaction() as c:
        for k, s in enumerate(samples, 1):
            _write(c, k, s)
            if s.state in ("ok", "degraded") and ".." not in s.name:
                place = path.parent / "missions" / s.name
                place.mkdir(parents=True, exist_ok=True)
                mark_report(place, Key(f"{k:064x}", "c" * 64, "1.0"))
    return path


def _write(c: Any, k: int, s: Sample) -> None:
    if s.state is not None:
        judged = s.state in ("ok", "degraded")
        folder = f"logs/{s.name}".split("/")[-2] if not judged or s.verdict == "not_assessed" else ""
        start = None if s.day is None or not judged else int(START_NS + s.day * DAY_NS)
        c.execute(
            "INSERT INTO result VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,NULL,NULL,NULL)",
            (k, f"{k:064x}", "c" * 64, "1.0", s.state, s.reason or ("" if s.state == "ok" else "It ends too early."), 1)
            + (
                s.machine or folder,
                s.machine_name if judged else "",
                s.verdict if judged else None,
                f"Sentence on {s.name}.",
                start,
            )
            + (
                (s.driving_s * 1.4, s.driving_s, s.driving_s * 0.8, s.driving_s * 0.3, 0, int(s.left_out))
                if judged
                else (None,) * 4 + (0, 0)
            )
            + (f"missions/{s.name}" if judged else None,),
        )
        for n, f in enumerate(s.faults, 1):
            e = f.epsilon or (None, None, None)
            kind = "steer" if f.component in AXLES else "wheel"
            row = (k, f"F{n}", f.component, kind, f.side, f.mode, f.severity, 5.0, 5.0 + f.seconds, (start or 0) + n)
            c.execute("INSERT INTO fault VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)", (*row, *e, None, None, 0.98, 0))
        for part in s.parts if judged else ():
            decided = 0.0 if part in s.blind else s.driving_s * 0.95
            e = s.epsilon.get(part, (None, None, None))
            row = (
                k,
                *part,
                s.driving_s,
                decided,
                decided,
                0.0,
                "",
                *e,
                None if e[0] is None else decided,
                int(s.relative),
            )
            c.execute("INSERT INTO component VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)", row)
    for name in (s.name, *s.copies):
        files = json.dumps([f"logs/{name}.mcap"])
        c.execute(
            "INSERT INTO mission VALUES (?,?,?,?,?,?)",
            (name, files, 10**6, k if s.state is not None else None, 1, 1 if s.gone else None),
        )


def write_report(
    folder: Path, name: str, cleared: bool | None = None, more: dict[str, Any] | None = None, **limits: float
) -> None:
    """A report that says no more than the fleet asks of it; `more` are further parts of it."""
    place = folder / "missions" / name
    place.mkdir(parents=True, exist_ok=True)
    machine = {"wheels": WHEELS, "axles": AXLES}
    said = {
        "limits": {"min_epsilon": 0.1, "min_assessed": 10.0, **limits},
        "machine": machine,
        "verdict": {"cleared": cleared},
        **(more or {}),
    }
    (place / "report.json").write_text(json.dumps(said), encoding="utf-8")
    (place / "report.html").write_text(f"<title>{len(name)}</title>", encoding="utf-8")


def bounds(value: float, half: float = 0.015) -> tuple[float, float, float]:
    return value, value - half, value + half


def few() -> list[Sample]:
    """Six machines as a fleet manager might see them."""
    rng = np.random.default_rng(7)
    out: list[Sample] = []
    valve, pickup = ("RL", "actuator"), ("front", "sensor")

    def add(machine: str, k: int, **more: Any) -> None:
        name = f"{machine}/2026-11-{k + 1:02d}"
        scatter = {p: bounds(float(0.01 + 0.006 * rng.standard_normal())) for p in PARTS}
        out.append(Sample(name, machine, float(k), **{**more, "epsilon": {**scatter, **more.get("epsilon", {})}}))

    for k in range(14):
        wear = float(0.02 + 0.011 * k + 0.006 * rng.standard_normal())
        found = [Fault(*valve, "inefficient", "medium", bounds(wear))] if wear > 0.1 else []
        stuck = [Fault(*pickup, "stuck", "high")] if k == 13 else []
        add(
            "HX4-07",
            k,
            verdict="stop" if stuck else "watch" if found else "ready",
            faults=stuck + found,
            epsilon={valve: bounds(wear)},
        )
        early = float(0.01 + 0.0045 * k + 0.004 * rng.standard_normal())
        add("HX4-11", k, epsilon={("FR", "actuator"): bounds(early)})
        silent = [Fault("RR", "sensor", "no_signal", "low", None, 0.6)] if k in (2, 7, 11) else []
        add("HX4-03", k, verdict="watch" if silent else "ready", faults=silent, blind=[("rear", "sensor")])
        saw = float(0.02 + 0.01 * (k if k < 8 else k - 8) + 0.005 * rng.standard_normal())
        noisy = [Fault("FL", "sensor", "noisy", "low")] if k in (12, 13) else []
        add("HX4-08", k, verdict="watch" if noisy else "ready", faults=noisy, epsilon={("FL", "actuator"): bounds(saw)})
        add("HX4-02", k)
    out.append(Sample("HX4-05/no date", "HX4-05", None))
    out.append(Sample("HX4-08/broken", "HX4-08", state="unreadable", reason="HX4-08/broken.mcap: ends after 12 bytes."))
    out.append(Sample("stray", "", state="timeout", reason="It took longer than 600 s."))
    out.append(Sample("waiting", "", state=None))
    return out


def hostile() -> list[Sample]:
    """Names that try to become markup, links, formulas or paths."""
    return [
        Sample(
            name, name, float(k), verdict="watch", machine_name=name, faults=[Fault(name, "actuator", "stuck", "high")]
        )
        for k, name in enumerate(HOSTILE)
    ] + [Sample("bad", "", state="crashed", reason=HOSTILE[1] + HOSTILE[0])]


def large(machines: int = 100, missions: int = 50, seed: int = 1) -> list[Sample]:
    """Many machines; some wear, some fail now and then."""
    rng = np.random.default_rng(seed)
    out = []
    for m in range(machines):
        slope = rng.choice([0.0, 0.0, 0.001, 0.003])
        for k in range(missions):
            epsilon = {p: bounds(float(0.01 + 0.006 * rng.standard_normal())) for p in PARTS}
            wear = float(0.01 + slope * k + 0.006 * rng.standard_normal())
            epsilon["RL", "actuator"] = bounds(wear)
            faults = [Fault(epsilon=bounds(wear))] if wear > 0.1 else []
            if rng.random() < 0.05:
                faults.append(Fault(str(rng.choice(WHEELS)), "sensor", str(rng.choice(["noisy", "no_signal"])), "low"))
            state = "unreadable" if rng.random() < 0.004 else "ok"
            name = f"site-{m % 7}/machine-{m:03d}/2026-{k // 28 + 1:02d}-{k % 28 + 1:02d}T07-30-00"
            verdict = "watch" if faults else "ready"
            out.append(Sample(name, f"machine-{m:03d}", k + m / 1000, state, verdict, faults, epsilon))
    return out
