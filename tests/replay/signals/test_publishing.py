"""Commands that are published on change: a heartbeat is found, the rest is said by the machine file, and silence stays silence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.channels.liveness import alive_sources
from diagnosis.channels.recording_gaps import recording_gaps
from diagnosis.decision.log_caveats import more_caveats
from diagnosis.direct.inputs import make_pair
from replay.errors import ConfigError
from replay.faults import Side
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.mission import Mission
from replay.signals.publishing import on_change_hint, on_change_hint_in
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align

MS = 1_000_000
STEP = 20  # ms
SIZE = 2000  # 40 s


def published(
    name: str, values: np.ndarray, beat: int | None = None, *, on_change: bool = False, topic: str = ""
) -> Signal:
    """A value of every 20 ms as it is sent when it changes, and else every `beat` steps."""
    sent, last = [0], 0
    for k in range(1, values.size):
        if values[k] != values[last] or (beat is not None and k - last >= beat):
            sent.append(k)
            last = k
    at = np.array(sent)
    origin = SignalSource(topic=topic or f"/{name}", field="data", on_change=on_change)
    return Signal(name, at.astype(np.int64) * STEP * MS, values[at], origin, "a.mcap", guessed=False)


def measured(name: str = "wheel.FR.v", kept: np.ndarray | None = None) -> Signal:
    at = np.arange(SIZE) if kept is None else kept
    return Signal(name, at * STEP * MS, np.sin(0.1 * at), SignalSource(topic=f"/{name}", field="data"), "a.mcap", False)


def aligned(*items: Signal) -> Timeline:
    return align(Signals({s.name: s for s in items}, {}))


def driven(pieces: int = 8) -> np.ndarray:
    """A command that moves for two seconds and then rests for three, again and again."""
    one = np.r_[0.3 + 0.1 * np.sin(0.2 * np.arange(100)), np.zeros(150)]
    return np.tile(one, pieces)


def test_a_value_stands_for_one_and_a_half_heartbeats() -> None:
    whole = driven()
    command = published("wheel.FR.u", whole, beat=25)
    got = aligned(measured(), command)
    np.testing.assert_array_equal(got.signals["wheel.FR.u"], whole)
    assert got.stands == {"wheel.FR.u": pytest.approx(0.75)}
    assert "wheel.FR.u: sent when it changes, and else every 0.5 s; a value stands for 0.75 s" in got.notes
    lost = replace(command, stamps=command.stamps[:500], values=command.values[:500])  # its sender falls silent
    silent = aligned(measured(), lost).signals["wheel.FR.u"]
    last = int(command.stamps[499]) // (STEP * MS)
    assert np.isfinite(silent[: last + 37]).all()
    assert np.isnan(silent[last + 39 :]).all()


def test_what_one_message_brings_is_repeated_together() -> None:
    """Of two values in one topic the one that rests comes again whenever the other changes: no heartbeat of its own."""
    moving = np.sin(0.3 * np.arange(SIZE)) * (driven() > 0)
    sent = published("wheel.FR.u", moving, beat=25, topic="/ecu")
    rest = replace(sent, name="wheel.FR.v_ref", values=np.full(sent.values.size, 0.3))
    got = aligned(measured(), sent, rest)
    assert set(got.stands) == {"wheel.FR.u", "wheel.FR.v_ref"}


@pytest.mark.parametrize(
    "kept",
    [
        np.flatnonzero(np.arange(SIZE) % 100 < 60),  # gaps in what repeats at every message
        np.sort(np.random.default_rng(1).choice(SIZE, 900, replace=False)),  # messages lost at random
    ],
    ids=["gaps", "losses"],
)
def test_lost_messages_are_no_heartbeat(kept: np.ndarray) -> None:
    command = replace(measured("wheel.FR.u", kept), values=driven()[kept])
    got = aligned(measured(), command)
    assert got.stands == {}
    assert np.isnan(got.signals["wheel.FR.u"]).any()


def test_on_change_a_value_stands_until_the_next() -> None:
    whole = driven()
    plain = aligned(measured(), published("wheel.FR.u", whole))
    assert np.mean(np.isnan(plain.signals["wheel.FR.u"])) > 0.5
    got = aligned(measured(), published("wheel.FR.u", whole, on_change=True))
    np.testing.assert_array_equal(got.signals["wheel.FR.u"], whole)
    assert got.stands["wheel.FR.u"] == pytest.approx(3.0, abs=0.05)
    assert got.fresh["wheel.FR.u"].sum() == plain.fresh["wheel.FR.u"].sum()  # what stands is no new sample


def test_a_reference_that_is_sent_once_stands_for_the_mission() -> None:
    once = published("wheel.FR.v_ref", np.full(SIZE, 0.3), on_change=True)
    assert np.isfinite(aligned(measured(), once).signals["wheel.FR.v_ref"]).all()


def test_nothing_stands_over_a_break_of_the_recording() -> None:
    kept = np.r_[0:1000, 1200:SIZE]
    once = published("wheel.FR.v_ref", np.full(SIZE, 0.3), on_change=True)
    got = aligned(measured(kept=kept), once)
    assert np.isfinite(got.signals["wheel.FR.v_ref"][:1000]).all()
    assert np.isnan(got.signals["wheel.FR.v_ref"][1001:]).all()
    assert recording_gaps(got) == [(1000, 1200)]


def test_a_wheel_that_falls_silent_beside_the_others_is_not_held() -> None:
    rng = np.random.default_rng(2)
    u = {w: 0.3 + 0.01 * rng.standard_normal(SIZE) for w in ("FR", "FL", "RR")}
    u["FR"][800:] = u["FR"][800]
    got = aligned(measured(), *(published(f"wheel.{w}.u", x, on_change=True) for w, x in u.items()))
    assert np.isfinite(got.signals["wheel.FR.u"][:800]).all()
    assert np.isnan(got.signals["wheel.FR.u"][810:]).all()
    assert np.isfinite(got.signals["wheel.FL.u"]).all()
    assert any("fell silent" in note and note.startswith("wheel.FR.u") for note in got.notes)
    u["FR"][800:] = 0.0  # at rest it need not be sent
    rests = aligned(measured(), *(published(f"wheel.{w}.u", x, on_change=True) for w, x in u.items()))
    assert np.isfinite(rests.signals["wheel.FR.u"]).all()


def test_what_is_rarely_sent_is_asked_for() -> None:
    items = {s.name: s for s in (measured(), published("wheel.FR.u", driven()))}
    hint = on_change_hint(items)
    assert hint.startswith(
        "wheel.FR.u comes rarely: each message differs from the last, and up to 3.0 s pass without one"
    )
    said, act = on_change_hint_in(["another note", hint])
    assert "add on_change = true to their lines under [signals]" in act
    assert "on_change" not in said
    stated = {**items, "wheel.FR.u": published("wheel.FR.u", driven(), on_change=True)}
    assert on_change_hint(stated) == ""
    with_heartbeat = {**items, "wheel.FR.u": published("wheel.FR.u", driven(), beat=25)}
    assert on_change_hint(with_heartbeat) == ""


def test_the_report_says_that_values_stand() -> None:
    once = published("wheel.FR.v_ref", np.full(SIZE, 0.3), on_change=True)
    signals = Signals({s.name: s for s in (measured(), once)}, {})
    (said,) = more_caveats(Mission((), signals, align(signals)), 0, Machine("one", "", ("FR",), None))
    assert "published on change" in said
    assert "for up to 40.0 s (wheel.FR.v_ref). One whose sender fell silent looks the same" in said


def test_readings_beside_a_rare_command_that_stands_all_count() -> None:
    steps = np.repeat([0.0, 0.3, 0.1, 0.2], SIZE // 4)
    for on_change, least in ((True, SIZE), (False, 0)):
        line = aligned(measured("wheel.FR.u_applied"), published("wheel.FR.u", steps, on_change=on_change))
        quiet = np.zeros(line.size, np.bool_)
        pair = make_pair(
            line, alive_sources(line), Side.ACTUATOR, "wheel.FR.u_applied", "wheel.FR.u", quiet, "1", 1.0, haulotte()
        )
        assert np.count_nonzero(pair.fresh & np.isfinite(pair.x)) >= least
        assert on_change or np.count_nonzero(pair.fresh & np.isfinite(pair.x)) < SIZE // 2


def test_a_topic_that_ends_is_not_taken_for_one_on_change() -> None:
    noisy = np.random.default_rng(3).standard_normal(SIZE)
    command = published("wheel.FR.u", noisy)
    ended = replace(command, stamps=command.stamps[:1000], values=command.values[:1000])
    assert on_change_hint({s.name: s for s in (measured(), ended)}) == ""


def test_a_recording_with_gaps_in_everything_is_not_asked_about() -> None:
    kept = np.flatnonzero(np.arange(SIZE) % 250 < 100)
    command = replace(measured("wheel.FR.u", kept))
    assert on_change_hint({s.name: s for s in (measured(kept=kept), command)}) == ""


def test_a_measurement_is_never_published_on_change(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    file.write_text('[signals]\n"wheel.FR.v" = { column = "v", on_change = true }\n', encoding="utf-8")
    with pytest.raises(ConfigError, match=r"'wheel\.FR\.v': on_change is for what is asked"):
        load_machine(file)
    file.write_text('[signals]\n"wheel.FR.u" = { column = "u", on_change = true }\n', encoding="utf-8")
    assert load_machine(file).signals["wheel.FR.u"].on_change
