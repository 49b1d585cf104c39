from __future__ import annotations

import pytest

from diagnosis.pages import labels
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode
from tests.report_samples import fault


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        ("/joint_states", "/joint_states"),
        ("<script>", "<script>"),
        ("größe ψ 車", "größe ψ 車"),
        ("a\u202eb", "a\\u202eb"),
        ("a\x1b[31m\n", "a\\x1b[31m\\x0a"),
        ("\u2066x\u2069\ufeff", "\\u2066x\\u2069\\ufeff"),
        ("\ud800", "\\ud800"),
        ("a\u00a0b", "a\u00a0b"),
    ],
)
def test_invisible_characters_are_escaped_and_the_rest_is_verbatim(raw: str, shown: str) -> None:
    assert labels.visible(raw) == shown


def test_made_visible_reaches_keys_and_lists() -> None:
    assert labels.made_visible({"a\x00": ["\x01", {"b": "\x02", "n": 1.5}]}) == {
        "a\\x00": ["\\x01", {"b": "\\x02", "n": 1.5}]
    }


@pytest.mark.parametrize(
    ("seconds", "digits", "words"),
    [
        (0, 0, "0:00"),
        (59.9996, 3, "1:00.000"),
        (3723.25, 2, "1:02:03.25"),
        (-1.5, 1, "−0:01.5"),
        (30.001, 3, "0:30.001"),
    ],
)
def test_clock(seconds: float, digits: int, words: str) -> None:
    assert labels.clock(seconds, digits) == words


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0193, "0.0193"),
        (None, "–"),
        (float("nan"), "–"),
        (-2.5, "−2.5"),
        (1000.0, "1\u202f000"),
        (12, "12"),
        (0.0, "0"),
    ],
)
def test_number(value: object, words: str) -> None:
    assert labels.number(value) == words


@pytest.mark.parametrize("start", [None, "x", 2**80, -(2**80)])
def test_impossible_start_is_called_unknown(start: object) -> None:
    assert labels.utc(start) == "unknown"


def test_start_in_utc() -> None:
    assert labels.utc(1_760_000_000_000_000_000) == "2025-10-09 08:53:20"


def test_titles_name_part_mode_and_size() -> None:
    assert labels.fault_title(fault(), HYDRAULIC) == "FR speed sensor stuck at 0.21 m/s"
    sat = {"mean": 0.1, "rms": 0.1, "low": 0.0, "high": 0.2, "unit": "rad"}
    assert (
        labels.fault_title(fault(component="front", kind="steer", sat=sat), HYDRAULIC)
        == "front steering sensor stuck at 5.73°"
    )
    assert labels.fault_title(fault(side="actuator", mode="noisy", sat=None), HYDRAULIC) == "FR drive valve disturbed"
    assert labels.fault_title(fault(mode="outside_table"), HYDRAULIC) == "FR speed sensor outside the tables"
    for value, gain in ((-0.907, "1.91"), (1.8, "−0.8")):
        size = {"value": value, "low": value - 0.1, "high": value + 0.1}
        title = labels.fault_title(fault(mode="outside_table", epsilon=size), HYDRAULIC)
        assert title == f"FR speed sensor outside the tables: {gain} times what it should be"


def test_legend_names_both_sides_where_they_differ() -> None:
    assert labels.mode_legend(FaultMode.STUCK) == "Stuck"
    assert labels.mode_legend(FaultMode.NOISY) == "Noisy / disturbed"


def test_titles_of_all_rows_with_their_sizes() -> None:
    sat = {"mean": 0.1, "rms": 0.25, "low": 0.0, "high": 0.2, "unit": "m/s"}
    epsilon = {"value": 0.123, "low": 0.1, "high": 0.2}
    titles = {
        (side, mode): labels.fault_title(fault(side=side, mode=mode, sat=sat, epsilon=epsilon), HYDRAULIC)
        for side in ("sensor", "actuator", "sensor_or_actuator")
        for mode in ("no_signal", "inefficient", "noisy")
    }
    assert list(titles.values()) == [
        "FR speed sensor: no signal",
        "FR speed sensor inefficient, reads 12 % too little",
        "FR speed sensor noisy, 0.0307 m/s r.m.s. of noise",
        "FR drive valve: no signal",
        "FR drive valve inefficient, 12 % lost",
        "FR drive valve disturbed, 0.0307 m/s r.m.s. of noise",
        "FR speed sensor or drive valve: no signal",
        "FR speed sensor or drive valve inefficient, 12 % lost",
        "FR speed sensor or drive valve noisy, 0.0307 m/s r.m.s. of noise",
    ]
    assert labels.fault_title(fault(mode="inefficient", epsilon=None), HYDRAULIC) == "FR speed sensor inefficient"
