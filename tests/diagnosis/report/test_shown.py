"""The table and the picture of what a mission would have shown."""

from __future__ import annotations

from typing import Any

from diagnosis.report.shown import HEADS, shown_lanes, shown_parts
from tests import report_samples as samples


def _row(deviation: str, for_s: float | None, size: float | None, unit: str, **more: Any) -> dict[str, Any]:
    about = {"component": "FR", "side": "sensor", "deviation": deviation, "for_s": for_s}
    return {**about, "size": size, "unit": unit, "share": None, "places": 100, "told": "sensor", **more}


def _report(*rows: dict[str, Any], traces: list[dict[str, Any]] | None = None) -> Any:
    return {**samples.five_faults()[0], "detectability": {"rows": list(rows), "traces": traces or []}}


def test_the_table_says_size_share_or_that_nothing_shows() -> None:
    (part,) = shown_parts(
        _report(
            _row("inefficient", 2.0, None, "1"),
            _row("inefficient", 10.0, 0.284, "1"),
            _row("no_signal", 2.0, None, "", share=0.934),
            _row("stuck", 10.0, 1.0, "", share=0.99),
            _row("offset", 10.0, 0.0416, "m/s"),
            _row("noisy", 10.0, None, "m/s", places=0),
        )
    )
    assert part.part == "FR speed sensor"
    assert dict(zip(HEADS[1:-1], part.cells, strict=True)) == {
        ">Loss for 2 s": "not shown",
        ">Loss for 10 s": "28 %",
        ">Loss all the time": "",
        ">Dead for 2 s": "found in 93 %",
        ">Stuck for 10 s": "found",
        ">Too much for 10 s": "",
        ">Offset for 10 s": "0.042 m/s",
        ">Noise for 10 s": "too brief",
        ">Delay": "",
    }
    assert part.told == "every other part"


def test_lanes_draw_losses_and_where_none_shows() -> None:
    trace = {"component": "FR", "side": "sensor", "start_s": [0.0, 1.0, 2.0, 10.0], "loss": [0.2, 0.5, None, 0.3]}
    (lane,) = shown_lanes(_report(_row("inefficient", 10.0, 0.3, "1"), traces=[trace]), 20.0)
    assert lane.area == "M0 100V80H100V100ZM100 100V50H200V100ZM1000 100V70H1150V100Z"
    assert lane.blind == "M200 0H350V100H200Z"
    assert (lane.words, lane.part, lane.first) == ("30 %", "speed sensor", True)


def test_sides_that_show_the_same_are_one_lane() -> None:
    trace = {"component": "FR", "side": "sensor", "start_s": [0.0], "loss": [0.2]}
    (lane,) = shown_lanes(_report(traces=[trace, {**trace, "side": "actuator"}]), 20.0)
    assert lane.part == "speed sensor or drive valve"
