"""Properties of the whole diagnosis: what shifts, permutes or repeats a mission does the same to its result."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import diagnosis
from diagnosis.output import write_result
from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.results.result import MissionResult
from replay.arrays import processors
from replay.errors import ConfigError, LogError
from replay.export.mission import write_mission
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import EvidenceLevel, SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

PAPER = haulotte()
FAULTS = (
    FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 6.0, 9.0, 1.0, 0.2),
    FaultSpec("RL", Side.ACTUATOR, FaultMode.NO_SIGNAL, 14.0, 17.0),
    FaultSpec("FL", Side.SENSOR, FaultMode.INEFFICIENT, 18.0, 23.0, 0.5),
)
SHIFT_NS = 86_400_000_000_000 + 7


@cache
def simulated(
    evidence: EvidenceLevel = "direct",
    faults: tuple[FaultSpec, ...] = FAULTS,
    seconds: float = 25.0,
    rate_hz: float = 200.0,
    seed: int = 5,
) -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(
            scenario="healthy", seed=seed, duration_s=seconds, rate_hz=rate_hz, evidence=evidence, faults=faults
        )
    )


def in_memory(mission: SimulatedMission, shift_ns: int = 0, keep: str = "") -> Mission:
    items = {
        name: Signal(name, mission.stamps + shift_ns, x, SignalSource(column=name), "a.mcap", guessed=False)
        for name, x in mission.columns.items()
        if re.search(keep, name)
    }
    signals = Signals(items, {})
    return Mission((), signals, align(signals))


@cache
def judged(evidence: EvidenceLevel) -> MissionResult:
    return diagnose_mission(in_memory(simulated(evidence)), PAPER)


@pytest.fixture(scope="module")
def mission() -> SimulatedMission:
    return simulated("direct")


@pytest.fixture(scope="module")
def result() -> MissionResult:
    return judged("direct")


def document(result: MissionResult) -> dict[str, Any]:
    """The report as it is read from disk."""
    return orjson.loads(orjson.dumps(result.report))  # type: ignore[no-any-return]


def test_injected_faults_are_found() -> None:
    report = diagnose_mission(in_memory(simulated(rate_hz=500.0, seed=3)), PAPER).report
    stated = [f for f in report["intervals"] if f["probability"] >= 0.9]
    found = {(f["component"], str(f["side"]), str(f["mode"])) for f in stated}
    assert found == {("FR", "sensor", "stuck"), ("RL", "actuator", "no_signal"), ("FL", "sensor", "inefficient")}
    for spec in FAULTS:
        longest = max(
            (f for f in stated if f["component"] == spec.component), key=lambda f: float(f["stop_s"] - f["start_s"])
        )
        assert longest["start_s"] == pytest.approx(spec.start_s, abs=0.05)
        assert longest["stop_s"] == pytest.approx(spec.stop_s, abs=0.05)
        assert longest["epsilon"]["value"] == pytest.approx(spec.epsilon, abs=0.01)
    assert report["verdict"]["status"] == "stop"


@pytest.mark.parametrize("seed", campaign([1, 2]))
def test_healthy_mission_at_full_rate_is_ready(seed: int) -> None:
    healthy = simulated(faults=(), seconds=20.0, rate_hz=1000.0, seed=seed)
    got = diagnose_mission(in_memory(healthy), PAPER).report
    assert [f for f in got["intervals"] if f["severity"] != "info"] == []
    assert got["verdict"]["status"] in ("ready", "not_assessed")
    decided = [row["decided_driving_s"] for row in got["coverage"] if row["component"] in PAPER.wheels]
    shown = all(check["passed"] for check in got["clearing"])
    assert (got["verdict"]["status"] == "ready") == (min(decided) >= PAPER.limits.min_assessed and shown)


@pytest.mark.parametrize("evidence", campaign(["base", "direct"]))
def test_shifting_the_clock_shifts_the_stamps_alone(evidence: EvidenceLevel) -> None:
    here, there = judged(evidence), diagnose_mission(in_memory(simulated(evidence), SHIFT_NS), PAPER)
    first, second = document(here), document(there)
    assert second["log"].pop("start_ns") == first["log"].pop("start_ns") + SHIFT_NS
    assert len(first["intervals"]) > 0
    for a, b in zip(first["intervals"], second["intervals"], strict=True):
        for key in ("start_ns", "stop_ns"):
            assert b.pop(key) == a.pop(key) + SHIFT_NS
    assert second == first
    for name, x in here.columns.items():
        assert_array_equal(there.columns[name], x, err_msg=name)


def sorted_parts(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=lambda r: (r["component"], r["side"], r.get("start_s", 0.0)))


def rounded(value: Any) -> Any:
    """Figures to six digits: sums over wheels depend on their order in the last ones."""
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    return [rounded(v) for v in value] if isinstance(value, list) else value


@pytest.mark.parametrize("evidence", campaign(["base", "direct"]))
def test_permuting_the_wheels_permutes_the_result_alone(evidence: EvidenceLevel) -> None:
    order = ("RL", "FR", "RR", "FL")
    straight = judged(evidence)
    shuffled = diagnose_mission(in_memory(simulated(evidence)), replace(PAPER, wheels=order))
    a, b = document(straight), document(shuffled)
    assert b["machine"]["wheels"] == list(order)
    assert len(a["intervals"]) > 0
    for key in ("intervals", "states", "coverage"):
        assert rounded(sorted_parts(b[key])) == rounded(sorted_parts(a[key])), key
    for key in ("phases", "log", "limits"):
        assert b[key] == a[key]
    assert b["verdict"]["status"] == a["verdict"]["status"]
    assert rounded(b["metrics"]["wheels"]) == rounded(a["metrics"]["wheels"])
    assert set(shuffled.columns) == set(straight.columns)
    for name, x in straight.columns.items():
        assert_allclose(shuffled.columns[name], x, rtol=1e-6, atol=1e-9, err_msg=name)


def test_same_files_give_the_same_bytes_at_any_time_wherever_they_lie(
    tmp_path: Path, mission: SimulatedMission
) -> None:
    here, there = (tmp_path / folder / "mission.mcap" for folder in ("here", "over-there/deeper"))
    for path in (here, there):
        path.parent.mkdir(parents=True)
        write_mission(mission, path, "mcap")
    first, elsewhere = (orjson.dumps(diagnose([path], PAPER).report) for path in (here, there))
    assert first == elsewhere
    text = first.decode()
    assert str(tmp_path) not in text
    assert not re.search(r'"/(tmp|home|root|Users)/', text)
    assert orjson.loads(first)["log"]["files"][0]["path"] == "mission.mcap"


def test_no_wall_time_in_the_report(mission: SimulatedMission, result: MissionResult) -> None:
    # any nanoseconds since 1970 are those of the log
    first, last = int(mission.stamps[0]), int(mission.stamps[-1]) + 2_000_000
    stamps = [int(n) for n in re.findall(r"\b\d{16,19}\b", orjson.dumps(result.report).decode())]
    assert stamps != []
    assert all(first <= n <= last for n in stamps)


def test_a_written_log_gives_what_its_signals_give(
    tmp_path: Path, mission: SimulatedMission, result: MissionResult
) -> None:
    path = tmp_path / "m.mcap"
    write_mission(mission, path, "mcap")
    read, held = diagnose([path], PAPER), result
    keys = ("component", "side", "mode")
    stated = [
        [(tuple(str(f[k]) for k in keys), f["start_s"]) for f in r.report["intervals"] if f["probability"] >= 0.9]
        for r in (read, held)
    ]
    assert [name for name, _ in stated[0]] == [name for name, _ in stated[1]]
    assert_allclose([t for _, t in stated[0]], [t for _, t in stated[1]], atol=0.02)


def test_states_leave_no_gap(result: MissionResult) -> None:
    report = result.report
    keys = {(c, s) for c in (*PAPER.wheels, *PAPER.axles) for s in ("sensor", "actuator")}
    assert {(s["component"], s["side"]) for s in report["states"]} == keys
    for component, side in keys:
        spans = [s for s in report["states"] if (s["component"], s["side"]) == (component, side)]
        assert spans[0]["start_s"] == 0.0
        assert spans[-1]["stop_s"] == pytest.approx(report["log"]["duration_s"])
        for a, b in pairwise(spans):
            assert a["stop_s"] == b["start_s"]
            assert a["state"] != b["state"]
        (row,) = (r for r in report["coverage"] if (r["component"], r["side"]) == (component, side))
        for state, seconds in row["seconds"].items():
            total = sum(s["stop_s"] - s["start_s"] for s in spans if s["state"] == state)
            assert total == pytest.approx(seconds, abs=1e-6)


def test_intervals_and_states_agree(result: MissionResult) -> None:
    for f in result.report["intervals"]:
        middle = (f["start_s"] + f["stop_s"]) / 2
        (state,) = (
            s["state"]
            for s in result.report["states"]
            if (s["component"], s["side"]) == (f["component"], f["side"]) and s["start_s"] <= middle < s["stop_s"]
        )
        assert state == f["mode"]


SPAN = {"start_s": float, "stop_s": float}
NUMBER = (int, float)
FIELDS: dict[str, Any] = {
    "schema": str,
    "tool": {"name": str, "version": str},
    "log": {"files": list, "start_ns": int, "duration_s": float, "rate_hz": float, "driving_s": float},
    "machine": {"name": str, "id": str, "wheels": list, "axles": list, "source": str},
    "readings": [{"name": str, "value": str, "detail": str}],
    "verdict": {
        "status": str,
        "title": str,
        "text": str,
        "caveats": list,
        "actions": [{"n": int, "text": str, "faults": list, "severity": str}],
    },
    "intervals": [
        {
            "id": str,
            "component": str,
            "kind": str,
            "side": str,
            "mode": str,
            **SPAN,
            "start_ns": int,
            "stop_ns": int,
            "probability": float,
            "hypotheses": [{"side": str, "mode": str, "p": float}],
            "severity": str,
            "advice": str,
            "evidence": list,
            "tier": str,
            "detected_s": (*NUMBER, type(None)),
        }
    ],
    "states": [{"component": str, "side": str, "state": str, **SPAN, "reason": str}],
    "phases": [{"name": str, **SPAN}],
    "coverage": [{"component": str, "side": str, "seconds": dict, "decided_driving_s": NUMBER}],
    "loss": list,
    "clearing": list,
    "metrics": {"wheels": dict, "average": dict, "paper": [{"controller": str, "parameters": int}]},
    "signals": [
        {
            "name": str,
            "channel": str,
            "unit": str,
            "recorded_unit": str,
            "rate_hz": float,
            "samples": int,
            "gaps": int,
            "longest_gap_s": NUMBER,
            "missing_share": NUMBER,
            "lsb": NUMBER,
            "guessed": bool,
            "source": str,
        }
    ],
    "missing": [{"name": str, "cost": str}],
    "quality": [{"check": str, "result": str, "effect": str, "ok": bool}],
    "limits": {"brief": NUMBER, "min_probability": NUMBER, "min_assessed": NUMBER, "clear_at": NUMBER},
}


def check(value: Any, wanted: Any, place: str) -> None:
    if isinstance(wanted, dict):
        assert isinstance(value, Mapping), place
        for key, part in wanted.items():
            assert key in value, f"{place}.{key}"
            check(value[key], part, f"{place}.{key}")
    elif isinstance(wanted, list):
        assert isinstance(value, list), place
        for i, item in enumerate(value):
            check(item, wanted[0], f"{place}[{i}]")
    else:
        assert isinstance(value, wanted), f"{place} = {value!r}"


@pytest.mark.parametrize("evidence", ["direct", "base"])
def test_report_has_the_fields_of_its_schema(evidence: EvidenceLevel) -> None:
    report = document(judged(evidence))
    check(report, FIELDS, "report")
    assert report["schema"] == "mfhca-report/1"
    for key in ("intervals", "states", "phases", "coverage", "signals", "quality", "readings"):
        assert report[key] != []
    for f in report["intervals"]:
        assert f["side"] in ("sensor", "actuator", "sensor_or_actuator")
        assert f["mode"] in [m.value for m in FaultMode]
        assert f["severity"] in ("info", "low", "medium", "high")
        assert f["start_ns"] < f["stop_ns"]
        assert sum(h["p"] for h in f["hypotheses"]) == pytest.approx(1.0, abs=0.01)
        if f["epsilon"] is not None:
            assert f["epsilon"]["low"] <= f["epsilon"]["value"] <= f["epsilon"]["high"]
        if f["sat"] is not None:
            assert f["sat"]["low"] <= f["sat"]["mean"] <= f["sat"]["high"]
            assert f["sat"]["unit"] in ("m/s", "rad", "of full opening")
    assert {s["state"] for s in report["states"]} <= {s.value for s in State}


def test_columns_stand_on_one_axis(result: MissionResult) -> None:
    columns = result.columns
    n = columns["t"].size
    assert {x.shape for x in columns.values()} == {(n,)}
    assert_allclose(np.diff(columns["t"]), 0.005)
    assert n * 0.005 == pytest.approx(result.report["log"]["duration_s"])
    for wheel in PAPER.wheels:
        for leaf in ("v_ref", "e", "psi_printed", "psi_implied", "rho", "u", "u_difference"):
            assert f"replay.{wheel}.{leaf}" in columns
        for side in ("sensor", "actuator"):
            assert f"evidence.{wheel}.{side}.residual" in columns


def test_part_of_a_mission(tmp_path: Path, mission: SimulatedMission) -> None:
    path = tmp_path / "m.mcap"
    write_mission(mission, path, "mcap")
    got = diagnose([path], PAPER, start_s=5.0, stop_s=12.0).report
    assert got["log"]["duration_s"] == pytest.approx(7.0, abs=0.01)
    stuck = max(
        (f for f in got["intervals"] if f["component"] == "FR"), key=lambda f: float(f["stop_s"] - f["start_s"])
    )
    assert stuck["start_s"] == pytest.approx(1.0, abs=0.05)
    assert stuck["start_ns"] == pytest.approx(int(mission.stamps[0]) + 6_000_000_000, abs=50_000_000)


def test_only_the_asked_wheels_are_judged(mission: SimulatedMission) -> None:
    got = diagnose_mission(in_memory(mission), PAPER, wheels=["RL"]).report
    assert {r["component"] for r in got["coverage"]} == {"RL", "front", "rear"}
    assert {f["component"] for f in got["intervals"]} <= {"RL", "front", "rear"}


def test_unjudged_steering_is_a_caveat() -> None:
    got = diagnose_mission(in_memory(simulated("base", ()), keep=r"^(?!steer\.front)"), PAPER).report
    assert any(c.startswith("Not judged: ") and "front steering" in c for c in got["verdict"]["caveats"])
    assert "front" in got["verdict"]["to_clear"][0]["reason"]  # what the verdict says is cleared by what it says
    assert got["verdict"]["text"].endswith(f"To clear it: {got['verdict']['to_clear'][0]['act']}.")


def test_wheel_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"--wheel XX.*FR, FL, RR, RL"):
        diagnose([tmp_path / "absent.mcap"], PAPER, wheels=["XX"])
    with pytest.raises(LogError, match="absent"):
        diagnose([tmp_path / "absent.mcap"], PAPER)


def test_speeds_alone_show_what_each_channel_shows_and_clear_nothing(mission: SimulatedMission) -> None:
    report = diagnose_mission(in_memory(mission, keep=r"^wheel\.\w+\.v$"), PAPER).report
    assert not report["verdict"]["cleared"]
    assert {(i["side"], i["mode"]) for i in report["intervals"]} <= {("sensor", "stuck"), ("sensor", "noisy")}


@pytest.mark.parametrize("frozen", [False, True])
def test_a_speed_alone_shows_what_its_channel_shows_and_the_title_says_what_is_missing(frozen: bool) -> None:
    n = 1500
    t = 0.02 * np.arange(n)
    v = 0.5 + 0.3 * np.sin(0.5 * t) + 0.01 * np.random.default_rng(1).normal(size=n)
    if frozen:
        v[700:1000] = v[700]
    stamps = 1_760_000_000_000_000_000 + 20_000_000 * np.arange(n, dtype=np.int64)
    name = "wheel.D.v"
    signals = Signals({name: Signal(name, stamps, v, SignalSource(column=name), "odometry.csv", guessed=True)}, {})
    machine = Machine(name="odometry", id="", wheels=("D",), geometry=None)
    report = diagnose_mission(Mission((), signals, align(signals)), machine).report
    verdict = report["verdict"]
    assert not verdict["cleared"]
    assert [(i["side"], i["mode"]) for i in report["intervals"]] == ([("sensor", "stuck")] if frozen else [])
    assert frozen or verdict["title"] == "No second speed to compare with"
    assert any("log the commands" in row["act"] for row in verdict["to_clear"])


def test_one_motor_rig() -> None:
    n = 3000
    t = np.arange(n) * 0.01
    v_ref = np.where(t % 8 < 6, 0.3 * np.sign(np.sin(2 * np.pi * t / 16) + 1e-9), 0.0)
    v = np.r_[np.zeros(10), v_ref[:-10]] + 0.003 * np.random.default_rng(1).normal(size=n)
    stamps = 1_760_000_000_000_000_000 + 10_000_000 * np.arange(n, dtype=np.int64)
    items = {
        name: Signal(name, stamps, x, SignalSource(column=name), "rig.csv", guessed=True)
        for name, x in {"wheel.M.v": v, "wheel.M.v_ref": v_ref}.items()
    }
    signals = Signals(items, {})
    rig = Machine(name="rig", id="", wheels=("M",), geometry=None)
    report = document(diagnose_mission(Mission((), signals, align(signals)), rig))
    assert report["machine"]["geometry"] is None
    assert report["machine"]["axles"] == []
    assert report["intervals"] == []
    assert report["verdict"]["status"] == "not_assessed"


def imported(path: Path) -> set[str]:
    """Modules that a file imports, wherever the import stands."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_the_diagnosis_never_sees_simulation_or_truth() -> None:
    folder = Path(diagnosis.__path__[0])
    files = sorted(folder.rglob("*.py"))
    assert len(files) > 15
    # scores, and what makes known faults, are the only things that may open a truth file; nothing that diagnoses may use them
    doors = {"simulating.py", "simulation_options.py", "injecting.py", "evaluating.py", "truths.py"}
    for path in files:
        names = imported(path)
        if path.parent.name == "api" and path.name in doors:
            continue
        if path.parent.name != "evaluation":
            hidden = {n for n in names if n.startswith(("replay.simulation", "replay.truth", "diagnosis.evaluation"))}
            hidden = {n for n in hidden if not n.startswith("diagnosis.evaluation.document")}  # types alone
            assert hidden == set(), path.name
        assert not any(n.startswith("replay.simulation") for n in names), path.name
        assert not any(n == "cli" or n.startswith("cli.") for n in names), path.name


@pytest.mark.parametrize("evidence", ["base", "direct"])
def test_two_processors_find_what_one_finds(
    evidence: EvidenceLevel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processors, "_alone", False)
    written, told = {}, {}
    for count in (1, 2):
        monkeypatch.setattr(processors, "processors", lambda count=count: count)
        told[count] = []
        result = diagnose_mission(in_memory(simulated(evidence)), PAPER, progress=told[count].append)
        files = write_result(result, tmp_path / str(count))
        written[count] = [file.read_bytes() for file in files]
    assert written[1] == written[2]
    assert told[1] == told[2]
