"""Reports and columns for the tests of the report page: every figure below is visible here."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.validation import report_of, validated

Columns = dict[str, NDArray[np.float64]]
Fault = tuple[
    str, str, str, str, float, float, float, float, str
]  # id, component, side, mode, start, stop, ε, sat, severity

FAULTS: list[Fault] = [
    ("F1", "FR", "sensor", "stuck", 30.0, 36.0, 1.0, 0.21, "high"),
    ("F2", "RL", "actuator", "inefficient", 60.0, 84.0, 0.35, 0.0, "medium"),
    ("F3", "FL", "sensor", "noisy", 44.0, 52.0, 0.2, 0.04, "low"),
    ("F4", "front", "sensor", "no_signal", 96.0, 98.5, 1.0, 0.0, "high"),
    ("F5", "RR", "actuator", "noisy", 100.0, 106.0, 0.3, 0.15, "medium"),
]
PAPER = [("MFHCA", 0.019, 0.125, 4), ("Yang", 0.032, 0.130, 16), ("Wang", 0.021, 0.145, 7)]
PLACES = {
    "FR": {"x": 1.05, "y": -0.73, "offset": -0.2, "axle": "front"},
    "FL": {"x": 1.05, "y": 0.73, "offset": 0.2, "axle": "front"},
    "RR": {"x": -1.05, "y": -0.73, "offset": -0.2, "axle": "rear"},
    "RL": {"x": -1.05, "y": 0.73, "offset": 0.2, "axle": "rear"},
}


def mission(
    wheels: list[str],
    axles: list[str],
    faults: list[Fault],
    *,
    duration: float = 120.0,
    rate: float = 100.0,
    geometry: dict[str, Any] | None = None,
    status: str = "stop",
) -> tuple[ReportDocument, Columns]:
    """Report and columns of a mission that drives forward, turns, stands and drives back."""
    rng = np.random.default_rng(7)
    n = int(duration * rate)
    t = np.arange(n) / rate
    x = t / duration
    plan = np.interp(x, [0, 0.04, 0.08, 0.5, 0.54, 0.6, 0.64, 0.95, 0.99, 1], [0, 0, 1, 1, 0, 0, -1, -1, 0, 0])
    speed = 0.36 * plan * (1 - 0.15 * np.sin(2 * np.pi * t / 23) ** 2)
    angle = 0.5 * np.sin(2 * np.pi * t / 41) * (np.abs(plan) > 0)
    columns: Columns = {"t": t}
    for i, w in enumerate(wheels):
        columns |= _wheel(w, speed * (1 + 0.02 * i), t, faults, rng)
    for a in axles:
        columns |= _axle(a, angle if a == "front" else -angle, t, faults, rng)
    for f in faults:
        columns |= _evidence(f, t, columns, rng)
    heading = np.cumsum(speed * np.tan(angle)) / rate
    columns["path.x"] = np.cumsum(speed * np.cos(heading)) / rate
    columns["path.y"] = np.cumsum(speed * np.sin(heading)) / rate
    return report_of(_report(wheels, axles, faults, duration, rate, geometry, status), "sample"), columns


def _hit(f: Fault, component: str, side: str, t: NDArray[np.float64]) -> NDArray[np.bool_]:
    return (t >= f[4]) & (t < f[5]) & (f[1] == component) & (f[2] == side)


def _wheel(
    w: str, ref: NDArray[np.float64], t: NDArray[np.float64], faults: list[Fault], rng: np.random.Generator
) -> Columns:
    lag = np.convolve(np.pad(ref, (30, 0), "edge"), np.ones(31) / 31, "valid")
    true, lost = lag.copy(), np.zeros(len(t))
    u = 0.42 * ref / 0.36 + 0.05 * np.sin(t)
    applied = u.copy()
    for f in faults:
        on = _hit(f, w, "actuator", t)
        applied[on] = (1 - f[6]) * u[on] + f[7] * np.sin(3 * t[on])
        true[on] *= 1 - f[6] / 2
    v = np.round((true + rng.normal(0, 0.002, len(t))) / 0.0015) * 0.0015
    for f in faults:
        on = _hit(f, w, "sensor", t)
        v[on] = {"stuck": f[7], "no_signal": 0.0}.get(f[3], 0.0) if f[6] == 1 else v[on] + rng.normal(0, f[7], on.sum())
        lost += on
    rho = 1.001 + np.abs(ref) + np.abs(v)
    implied = np.sqrt(np.abs(0.1 + 0.03 * np.sin(t / 5)))
    v[int(0.9 * len(t)) : int(0.9 * len(t)) + 40] = np.nan
    return {
        f"wheel.{w}.v": v,
        f"wheel.{w}.v_true": np.round(true / 0.0015) * 0.0015,
        f"wheel.{w}.u": np.round(u / 0.001) * 0.001,
        f"wheel.{w}.u_applied": applied,
        f"replay.{w}.v_ref": ref,
        f"replay.{w}.u": u - 0.1 + 0.02 * lost,
        f"replay.{w}.psi_printed": 0.4 * np.exp(-1.4 * t),
        f"replay.{w}.psi_implied": implied,
        f"replay.{w}.rho": rho,
    }


def _axle(
    a: str, ref: NDArray[np.float64], t: NDArray[np.float64], faults: list[Fault], rng: np.random.Generator
) -> Columns:
    phi = np.convolve(np.pad(ref, (40, 0), "edge"), np.ones(41) / 41, "valid") + rng.normal(0, 0.001, len(t))
    for f in faults:
        phi[_hit(f, a, "sensor", t)] = f[7]
    u = ref - phi
    return {f"steer.{a}.phi": phi, f"replay.{a}.phi_ref": ref, f"steer.{a}.u": u, f"replay.{a}.u": u + 0.002}


def _evidence(f: Fault, t: NDArray[np.float64], columns: Columns, rng: np.random.Generator) -> Columns:
    name, base = f[1], f"evidence.{f[1]}.{f[2]}."
    steer = f"steer.{name}.phi" in columns
    on = ((t >= f[4]) & (t < f[5])).astype(float)
    soft = np.convolve(on, np.ones(50) / 50, "same")
    measured = columns[f"steer.{name}.phi" if steer else f"wheel.{name}.v"]
    expected = columns[f"replay.{name}.phi_ref"] if steer else columns[f"wheel.{name}.v_true"]
    healthy = 1 - 0.99 * soft
    data = {
        "residual": measured - expected,
        "threshold": np.full(len(t), 0.02) + 0.01 * soft,
        "expected": expected,
        "p_healthy": healthy,
        **{f"p_{m}": np.zeros(len(t)) + 0.01 * soft for m in ("stuck", "no_signal", "inefficient", "noisy")},
    }
    data[f"p_{f[3]}"] = 1 - healthy - 0.03 * soft
    return {base + k: v for k, v in data.items()}


def _interval(f: Fault, axles: list[str]) -> dict[str, Any]:
    steer = f[1] in axles
    unit = "fraction" if f[2] == "actuator" else "rad" if steer else "m/s"
    return {
        "id": f[0],
        "component": f[1],
        "kind": "steer" if steer else "wheel",
        "side": f[2],
        "mode": f[3],
        "start_s": f[4],
        "stop_s": f[5],
        "start_ns": 1_760_000_000_000_000_000 + int(f[4] * 1e9),
        "stop_ns": 1_760_000_000_000_000_000 + int(f[5] * 1e9),
        "epsilon": {"value": f[6], "low": f[6] - 0.03, "high": min(1.0, f[6] + 0.03)},
        "sat": {"mean": f[7], "rms": abs(f[7]), "low": f[7] - 0.01, "high": f[7] + 0.01, "unit": unit},
        "probability": 0.985,
        "hypotheses": [
            {"side": f[2], "mode": f[3], "p": 0.985},
            {"side": "actuator" if f[2] == "sensor" else "sensor", "mode": "inefficient", "p": 0.012},
            {"side": f[2], "mode": "no_signal" if f[3] == "stuck" else "stuck", "p": 0.003},
        ],
        "severity": f[8],
        "advice": f"Check connector and cable of {f[1]}, then repeat a slow straight run.",
        "evidence": [
            f"The reading left its expected value by more than the threshold for {f[5] - f[4]:.1f} s.",
            "The other wheels followed the same command within 0.01 m/s.",
        ],
        "tier": "direct" if f[2] == "sensor" else "model",
        "detected_s": None,
    }


def _states(parts: list[tuple[str, str]], faults: list[Fault], duration: float) -> list[dict[str, Any]]:
    rows = []
    for component, side in parts:
        mine = sorted((f for f in faults if f[1] == component and f[2] == side), key=lambda f: f[4])
        marks = [(0.0, 0.04 * duration, "not_excited")]
        marks += [(f[4], f[5], f[3]) for f in mine]
        marks.append((0.54 * duration, 0.6 * duration, "not_excited"))
        if any(f[1] == component and f[2] != side and f[3] == "stuck" for f in faults):
            marks.append((30.0, 36.0, "masked"))
        if side == "actuator" and component == "FL":
            marks.append((0.7 * duration, 0.74 * duration, "slip"))
        at = 0.0
        for start, stop, state in sorted(marks):
            if start > at:
                rows.append(_span(component, side, "healthy", at, start))
            rows.append(_span(component, side, state, start, stop))
            at = stop
        rows.append(_span(component, side, "healthy", at, duration))
    return rows


def _span(component: str, side: str, state: str, start: float, stop: float) -> dict[str, Any]:
    if component == "rear" and side == "actuator":
        state = "not_assessed"
    return {"component": component, "side": side, "state": state, "start_s": start, "stop_s": stop, "reason": ""}


def _coverage(states: list[dict[str, Any]]) -> list[dict[str, Any]]:
    sums: dict[tuple[str, str], dict[str, float]] = {}
    for s in states:
        seconds = sums.setdefault((s["component"], s["side"]), {})
        seconds[s["state"]] = seconds.get(s["state"], 0.0) + s["stop_s"] - s["start_s"]
    return [
        {
            "component": c,
            "side": side,
            "tier": "model" if "healthy" in v else "none",
            "seconds": v,
            "driving_s": 0.8 * v.get("healthy", 0.0),
            "decided_driving_s": 0.8 * v.get("healthy", 0.0),
        }
        for (c, side), v in sums.items()
    ]


def _report(
    wheels: list[str],
    axles: list[str],
    faults: list[Fault],
    duration: float,
    rate: float,
    geometry: dict[str, Any] | None,
    status: str,
) -> dict[str, Any]:
    parts = [(c, s) for c in (*wheels, *axles) for s in ("sensor", "actuator")]
    states = _states(parts, faults, duration)
    times = [0, 0.04, 0.25, 0.33, 0.54, 0.6, 0.96, 1]
    words = ["standstill", "forward", "turning", "forward", "standstill", "reverse", "standstill"]
    error = {"mission": 0.0213, "driving": 0.0251}
    effort = {"mission": 0.112, "driving": 0.131}
    worst = [f for f in faults if f[8] in {"high", "medium"}]
    return {
        "schema": "mfhca-report/1",
        "tool": {"name": "mfhca-replay", "version": "0.1.0"},
        "log": {
            "files": [
                {
                    "path": "slope-test-03.mcap",
                    "sha256": "9f2c" + "0" * 60,
                    "bytes": 48_210_331,
                    "format": "mcap",
                    "damage": [],
                    "notes": ["2 chunks without CRC"],
                    "clock": None,
                },
            ],
            "start_ns": 1_760_000_000_000_000_000,
            "open_loop": False,
            "duration_s": duration,
            "rate_hz": rate,
            "distance_m": 0.29 * duration,
            "driving_s": 0.86 * duration,
        },
        "machine": {
            "name": "Haulotte 16RTJ PRO",
            "id": "HX4-07",
            "wheels": wheels,
            "axles": axles,
            "geometry": geometry,
            "source": "paper defaults",
        },
        "readings": [
            {
                "name": "control law",
                "value": "opposed (fitted)",
                "detail": "λ = 1.002 ± 0.003 on unsaturated increments",
            },
            {
                "name": "reverse driving",
                "value": "signed",
                "detail": "the printed law has no stable equilibrium in reverse",
            },
            {"name": "Ψ̂(0)", "value": "0.41 (fitted)", "detail": "the paper gives none"},
        ],
        "verdict": {
            "status": status,
            "cleared": status in {"ready", "watch"},
            "not_cleared": "",
            "to_clear": [],
            "title": f"{len(worst)} faults to repair, {len(faults) - len(worst)} to watch"
            if faults
            else "No fault found",
            "text": "The front-right speed sensor froze at 0.21 m/s for 6.0 s while the other wheels followed, "
            "and the front steering angle was silent for 2.5 s. The rear-left drive lost a third of its effect."
            if faults
            else "Every speed sensor and drive valve that could be judged was healthy.",
            "caveats": [
                "The rear steering valve was replayed but is not assessed.",
                "Printed and recorded control differ: the log was not made by the printed Ψ̂ law.",
            ],
            "actions": [
                {
                    "n": i + 1,
                    "text": f"Repair {f[1]} {f[2]}: {f[3].replace('_', ' ')}.",
                    "faults": [f[0]],
                    "severity": f[8],
                }
                for i, f in enumerate(worst)
            ],
        },
        "intervals": [_interval(f, axles) for f in faults],
        "states": states,
        "phases": [
            {"name": w, "start_s": a * duration, "stop_s": b * duration}
            for w, a, b in zip(words, times[:-1], times[1:], strict=True)
        ],
        "coverage": _coverage(states),
        "loss": [],
        "clearing": [],
        "metrics": {
            "wheels": {w: {"tracking_error": error, "control_effort": effort} for w in wheels},
            "average": {"tracking_error": error, "control_effort": effort},
            "paper": [
                {"controller": c, "tracking_error": e, "control_effort": u, "parameters": p} for c, e, u, p in PAPER
            ],
        },
        "signals": [
            {
                "name": f"wheel.{w}.{leaf}",
                "channel": f"/joint_states.{leaf}[{w.lower()}_wheel]",
                "unit": unit,
                "recorded_unit": recorded,
                "rate_hz": rate,
                "samples": int(duration * rate),
                "gaps": 1 if leaf == "v" else 0,
                "longest_gap_s": 0.4 if leaf == "v" else 0.0,
                "missing_share": 0.0033 if leaf == "v" else 0.0,
                "lsb": 0.0015 if leaf != "u" else 0.001,
                "guessed": leaf == "v",
                "source": "slope-test-03.mcap",
            }
            for w in wheels
            for leaf, unit, recorded in (("v", "m/s", "rad/s"), ("v_true", "m/s", "m/s"), ("u", "fraction", "%"))
        ],
        "missing": [
            {"name": "wheel.FR.pressure_a", "cost": "a weak drive cannot be told from a steep slope below ε = 0.2"}
        ],
        "quality": [
            {"check": "Sample rate", "result": f"{rate:g} Hz, jitter 0.03 ms", "effect": "none", "ok": True},
            {
                "check": "Gaps",
                "result": "0.4 s in every wheel speed at 108 s",
                "effect": "that time is not decided",
                "ok": False,
            },
            {"check": "Clock", "result": "one clock, no jump", "effect": "none", "ok": True},
        ],
        "limits": {
            "brief": 1.0,
            "min_probability": 0.9,
            "min_epsilon": 0.1,
            "min_sat": 0.02,
            "min_assessed": 10.0,
            "clear_at": 0.25,
            "driving_speed": 0.02,
        },
    }


def five_faults(duration: float = 120.0, rate: float = 100.0) -> tuple[ReportDocument, Columns]:
    """Four wheels, two steering axles, five faults."""
    return mission(["FR", "FL", "RR", "RL"], ["front", "rear"], FAULTS, duration=duration, rate=rate, geometry=PLACES)


def one_wheel() -> tuple[ReportDocument, Columns]:
    """One drive on a rig: no geometry, no steering, no path."""
    report, columns = mission(["drive"], [], [("F1", "drive", "sensor", "stuck", 30.0, 32.0, 1.0, 0.2, "high")])
    return report, {k: v for k, v in columns.items() if not k.startswith("path.")}


def no_faults() -> tuple[ReportDocument, Columns]:
    """Four healthy wheels."""
    return mission(["FR", "FL", "RR", "RL"], ["front", "rear"], [], geometry=PLACES, status="ready")


def six_wheels() -> tuple[ReportDocument, Columns]:
    """Six wheels on three axles, the middle one fixed."""
    wheels = ["R1", "L1", "R2", "L2", "R3", "L3"]
    axles = ["front", "fixed", "rear"]
    places = {
        w: {"x": 2.0 - 2 * (i // 2), "y": (-0.8, 0.8)[i % 2], "offset": 0.0, "axle": axles[i // 2]}
        for i, w in enumerate(wheels)
    }
    faults: list[Fault] = [
        ("F1", "L2", "actuator", "stuck", 40.0, 45.0, 1.0, 0.3, "high"),
        ("F2", "L2", "sensor", "inefficient", 90.0, 99.0, 0.4, 0.0, "low"),
    ]
    return mission(wheels, ["front", "rear"], faults, geometry=places)


def not_assessed() -> tuple[ReportDocument, Columns]:
    """A mission in which nothing could be judged: every list that may be empty is, and there are no columns."""
    report, _ = mission(["FR", "FL"], [], [], duration=12.0, status="not_assessed")
    nothing = {"mission": None, "driving": None}
    report["log"] |= {"files": [], "distance_m": None, "driving_s": 0.0}
    report["verdict"] |= {"title": "Not assessed", "text": "The machine never moved.", "caveats": [], "cleared": False}
    report["states"] = [_span(w, s, "not_excited", 0.0, 12.0) for w in ("FR", "FL") for s in ("sensor", "actuator")]
    report["coverage"] = _coverage(report["states"])
    report["metrics"] = {
        "wheels": {},
        "average": {"tracking_error": nothing, "control_effort": nothing},
        "paper": [],
    }
    return report | {k: [] for k in ("readings", "phases", "signals", "missing", "quality")}, {}


def fault(**changes: Any) -> IntervalRow:
    """One interval of a report: wheel FR's speed sensor stuck from 30 s to 36 s, but for what is given."""
    return validated(_interval(FAULTS[0], []) | changes, IntervalRow, "sample", "")


def report_with(**changes: Any) -> ReportDocument:
    """A report in which nothing is known but what is given; of its objects the keys that are given."""
    report, _ = not_assessed()
    whole: dict[str, Any] = {k: {**v, **changes.get(k, {})} if isinstance(v, dict) else v for k, v in report.items()}
    return report_of(whole | {k: v for k, v in changes.items() if not isinstance(v, dict)}, "sample")


HOSTILE = [
    "<script>alert(1)</script>",
    "</style><img src=x onerror=alert(2)>",
    "a\u202eb\x1b[31m",
    "{{ 7*7 }}",
    "=1+1",
    "</script>",
    "'\" onload=1",
]


def hostile() -> tuple[ReportDocument, Columns]:
    """Names, sentences and channels that try to be markup, code or terminal control."""
    wheels = HOSTILE[:4]
    faults: list[Fault] = [
        ("F1", wheels[0], "sensor", "stuck", 30.0, 36.0, 1.0, 0.2, "high"),
        ("F2", wheels[2], "actuator", "noisy", 50.0, 60.0, 0.3, 0.1, "low"),
    ]
    report, columns = mission(wheels, [], faults)
    report["machine"]["name"] = report["machine"]["id"] = HOSTILE[0] + HOSTILE[2]
    report["verdict"] |= {"title": HOSTILE[1], "text": HOSTILE[5], "caveats": HOSTILE}
    report["log"]["files"][0] |= {"path": HOSTILE[5] + HOSTILE[6], "notes": HOSTILE}
    report["signals"][0]["channel"] = HOSTILE[4] + HOSTILE[0]
    report["intervals"][0] |= {"advice": HOSTILE[1], "evidence": HOSTILE}
    report["readings"] += [{"name": h, "value": h, "detail": h} for h in HOSTILE]
    return report, columns
