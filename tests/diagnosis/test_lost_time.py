"""Where nothing at all was recorded nothing is judged, and no fault reaches into it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.channels.recording_gaps import recording_gaps, without_gaps
from diagnosis.pipeline import diagnose
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.arrays.column_store import ColumnStore
from replay.faults import FaultMode, Side, State
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline
from tests.campaigns import campaign

SAMPLES = Path(__file__).resolve().parents[2] / "sample_logs"
MS = 1_000_000


def timeline(*fresh: np.ndarray, period_ms: int = 10) -> Timeline:
    names = [f"wheel.{w}.v" for w in ("FR", "FL")][: len(fresh)]
    signals = {n: np.where(f, 1.0, np.nan) for n, f in zip(names, fresh, strict=True)}
    periods = dict.fromkeys(names, period_ms * MS)
    return Timeline(0, 10 * MS, fresh[0].size, signals, dict(zip(names, fresh, strict=True)), {}, periods)


def seen(size: int, *lost: tuple[int, int]) -> np.ndarray:
    out = np.ones(size, np.bool_)
    for a, b in lost:
        out[a:b] = False
    return out


@pytest.mark.parametrize("block", [1 << 19, 64, 7])
def test_gaps_are_where_every_signal_is_silent(block: int) -> None:
    a, b = seen(1000, (100, 200), (400, 420), (900, 1000)), seen(1000, (120, 260), (400, 420), (880, 1000))
    mission = replace(timeline(a, b), store=ColumnStore(block=block))
    assert recording_gaps(mission) == [(120, 200), (900, 1000)]  # a fifth of a second is no gap
    assert recording_gaps(timeline(seen(1000, (0, 60)))) == [(0, 60)]


def test_slow_signals_leave_no_gaps() -> None:
    slow = np.zeros(1000, np.bool_)
    slow[::40] = True  # a sample every 0.4 s
    assert recording_gaps(timeline(slow, period_ms=400)) == []


def finding(start: int, stop: int) -> Finding:
    return Finding(start, stop, Side.SENSOR, FaultMode.NOISY, 0.99, (), None, None, ("seen",), "direct", start + 5)


def judged(*findings: Finding) -> Assessment:
    states = np.full(1000, CODE[State.HEALTHY], np.int8)
    for f in findings:
        states[f.start : f.stop] = CODE[State.NOISY]
    return Assessment(states, findings=findings, columns={"residual": np.ones(1000)}, tier=Tier.DIRECT)


def test_faults_end_where_a_hole_begins_and_say_so() -> None:
    line = timeline(seen(1000, (300, 500)))
    out = without_gaps(judged(finding(200, 320), finding(490, 700), finding(800, 900)), [(300, 500)], line)
    assert [(f.start, f.stop) for f in out.findings] == [(200, 300), (500, 700), (800, 900)]
    assert "after it" in out.findings[0].evidence[-1]
    assert "before it" in out.findings[1].evidence[-1]
    assert out.findings[1].detected == 500
    assert out.findings[2].evidence == ("seen",)
    assert set(out.states[300:500]) == {CODE[State.NO_DATA]}
    assert np.isnan(out.columns["residual"][300:500]).all()
    assert np.isfinite(out.columns["residual"][500:]).all()


def test_a_fault_that_was_hardly_seen_is_none() -> None:
    line = timeline(seen(1000, (300, 500)))
    out = without_gaps(judged(finding(300, 500), finding(295, 400)), [(300, 500)], line)
    assert out.findings == ()
    assert CODE[State.NOISY] not in out.states
    assert out.states[297] == CODE[State.NOT_ASSESSED]


@pytest.mark.parametrize("place", campaign([0.35, 0.5]))
def test_a_lost_chunk_is_no_fault(tmp_path: Path, place: float) -> None:
    data = bytearray((SAMPLES / "healthy_ice.mcap").read_bytes())
    data[int(len(data) * place)] ^= 0xFF
    log = tmp_path / "lost.mcap"
    log.write_bytes(data)
    report = diagnose([log], haulotte()).report
    assert report["intervals"] == []
    assert report["verdict"]["status"] == "not_assessed"
    lost = [s for s in report["states"] if s["component"] == "front" and s["state"] == "no_data"]
    assert max(s["stop_s"] - s["start_s"] for s in lost) > 13.0
    assert "unknown" in {p["name"] for p in report["phases"]}
