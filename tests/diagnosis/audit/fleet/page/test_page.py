"""Parts of the fleet page: policy, addresses, symbols, matrix and the pictures of trends."""

from __future__ import annotations

import base64
import hashlib
import re
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from diagnosis.audit.fleet.page.matrix import matrix
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet.page.rows import symbol
from diagnosis.audit.fleet.page.shown import address as address_of
from diagnosis.audit.fleet.page.svg import sparkline, sprite, trend_picture
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample, bounds

VALVE = ("RL", "actuator")


def document(tmp_path: Path, *missions: Sample) -> dict[str, Any]:
    return fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))


def test_the_policy_admits_the_two_scripts_of_the_page_alone(tmp_path: Path) -> None:
    page = build_fleet_page(document(tmp_path, *samples.few()))
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy
    scripts = re.findall(r"<script>(.*?)</script>", page, flags=re.DOTALL)
    hashes = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    allowed = policy[1].replace("&#39;", "'")
    assert re.findall(r"'sha256-([^']*)'", allowed) == hashes
    assert allowed.startswith("default-src 'none'; ")
    assert "connect-src" not in allowed
    assert "http" not in page.partition("<body>")[2].replace("http-equiv", "")


@pytest.mark.parametrize(
    ("report", "address"),
    [
        ("missions/a", "missions/a/report.html"),
        ("missions/a b#1?%", "missions/a%20b%231%3F%25/report.html"),
        ("javascript:alert(1)", "javascript%3Aalert%281%29/report.html"),
        ("missions/ä", "missions/%C3%A4/report.html"),
        ("../up", ""),
        ("missions/../../up", ""),
        ("/etc", ""),
        ("", ""),
        (None, ""),
    ],
)
def test_addresses_are_escaped_and_stay_below_the_page(report: str | None, address: str) -> None:
    assert address_of(report) == address


@pytest.mark.parametrize(
    ("verdict", "mode", "shown"),
    [
        ("stop", "stuck", "stuck"),
        ("watch", "of the future", "outside_table"),
        ("ready", None, "healthy"),
        ("not_assessed", None, "not_assessed"),
        ("watch", None, "warning"),
        (None, None, "warning"),
    ],
)
def test_every_mission_has_a_symbol(verdict: str | None, mode: str | None, shown: str) -> None:
    assert symbol({"verdict": verdict, "faults": [{"mode": mode}] if mode else []}) == shown
    assert f'id="g-{shown}"' in sprite()


def test_the_matrix_counts_missions_by_part_and_tells_none_from_not_assessed(tmp_path: Path) -> None:
    d = document(
        tmp_path,
        Sample("a", faults=[Fault(), Fault(mode="stuck", severity="high")], blind=[("FR", "sensor")]),
        Sample("b", day=1.0, faults=[Fault(side="sensor_or_actuator")], blind=[("FR", "sensor")]),
        Sample("c", "HX-2"),
    )
    m = matrix(d["machines"])
    assert [c for c, _ in m.heads] == ["FR", "FL", "RR", "RL", "front", "rear"]
    ((label, cells, total),) = m.rows
    assert (label, total, m.quiet) == ("HX-1", 4, 1)
    text = [re.sub(r"<[^>]*>", " ", str(c)).split() for c in cells]
    assert text[0] == ["–", "never", "judged", "long", "enough"]
    assert text[1] == ["0"]
    assert text[6] == ["1", "Inefficient"]
    assert text[7] == ["2", "Inefficient", "1", "Stuck"]


def test_a_trend_is_drawn_with_its_limit_its_change_and_its_outlier(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    wear = np.concatenate([0.02 + 0.012 * np.arange(10), 0.01 + 0.004 * np.arange(12)]) + 0.003 * rng.standard_normal(
        22
    )
    wear[17] = 0.5
    d = document(tmp_path, *(Sample(f"{k}", day=k, epsilon={VALVE: bounds(float(v))}) for k, v in enumerate(wear)))
    (t,) = d["trends"]
    assert [c["kind"] for c in t["changes"]] == ["drop"]
    assert t["outliers"] == [17]
    picture = trend_picture(t, "HX-1 · RL drive valve", "h")
    for style in ('class="lim"', 'class="chg"', 'class="odd"', 'class="band"', 'class="when', 'class="fit far"'):
        assert style in picture
    assert "22 missions; " in picture
    page = build_fleet_page(d)
    assert "as by a repair" in page
    assert "1 outlier excluded" in page


@pytest.mark.parametrize(
    "missions", [[], [Sample("a", state="crashed")], [Sample("a", driving_s=0.0, epsilon={VALVE: bounds(0.1)})]]
)
def test_hardly_anything_still_makes_a_page(tmp_path: Path, missions: list[Sample]) -> None:
    page = build_fleet_page(document(tmp_path, *missions))
    assert "nan" not in re.sub(r"<(script|style)>.*?</\1>", "", page, flags=re.DOTALL).lower()


def test_faults_of_a_mission_that_read_alike_are_counted(tmp_path: Path) -> None:
    alike = Fault(*VALVE, "stuck", "high")
    page = build_fleet_page(document(tmp_path, Sample("a", verdict="stop", faults=(alike, alike, alike))))
    assert "RL drive valve stuck, 3 times" in page
    assert "RL drive valve stuck; RL drive valve stuck" not in page


def test_a_rise_far_below_its_limit_is_told_as_such_and_the_line_beside_the_last_mission(tmp_path: Path) -> None:
    def page(name: str, losses: list[float], half: float) -> str:
        return build_fleet_page(
            document(
                tmp_path / name,
                *(Sample(f"d{k}", day=float(k), epsilon={VALVE: bounds(x, half)}) for k, x in enumerate(losses)),
            )
        )

    low = page("low", [0.000, 0.001, 0.002, 0.003, 0.004, 0.006], 0.0005)
    assert "0.6\u00a0% over its whole last mission, rising far below its limit" in low
    assert "no step, and no limit that comes near" in low
    none = page("none", [0.002, 0.001, 0.002, 0.001, 0.002, 0.001], 0.0005)
    assert "no loss of any part over its last mission" in none
    assert "over its whole last mission" not in none.partition("Recurring and new faults")[0]
    high = page("high", [0.1, 0.2, 0.3, 0.35, 0.4, 0.45], 0.02)
    assert re.search(
        r"Over its whole last mission, fast driving counting more, 45\.0\u00a0% was lost; the line through all missions is at \d\d\.\d\u00a0% now",
        high,
    )


def test_an_unclear_kind_is_no_mode_in_the_matrix(tmp_path: Path) -> None:
    stuck = [Fault("FR", "actuator", "stuck", "medium")]
    samples.write_store(tmp_path / "fleet.sqlite", [Sample("AX/1", "AX", 1.0, verdict="watch", faults=stuck)])
    with closing(sqlite3.connect(tmp_path / "fleet.sqlite")) as c, c:
        c.execute("UPDATE fault SET unclear = 1")
    found = fleet_json(load_fleet(tmp_path / "fleet.sqlite"))
    (part,) = (p for p in found["machines"][0]["parts"] if (p["component"], p["side"]) == ("FR", "actuator"))
    assert part["modes"] == {"faulty, kind unclear": 1}
    (row,) = matrix(found["machines"]).rows
    assert any("faulty, kind unclear in 1" in cell for cell in row[1])
    assert not any("Stuck" in cell for cell in row[1])


def test_a_machine_of_several_folders_says_that_its_id_makes_it_one(tmp_path: Path) -> None:
    both = [Sample(f"{folder}/m", "sample", day) for folder, day in (("AX", 1.0), ("BX", 2.0))]
    page = build_fleet_page(document(tmp_path, *both))
    assert "sample has logs of 2 folders (AX, BX), which its id makes one machine." in page
    assert "which its id makes one machine" not in build_fleet_page(document(tmp_path / "few", *samples.few()))


def test_a_course_names_the_losses_mission_by_mission_and_whether_the_fault_lasts(tmp_path: Path) -> None:
    lost = [Fault("RR", "actuator", epsilon=(e, e - 0.01, e + 0.01)) for e in (0.5, 0.65)]
    missions = [Sample("a")] + [Sample(f"b{k}", day=k + 1.0, verdict="watch", faults=[f]) for k, f in enumerate(lost)]
    document = fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))
    page = build_fleet_page(document)
    assert "50 → 65\u00a0% (64 to 66\u00a0%) lost in the fault, mission by mission" in page
    assert "last seen before its log ended" in page
    for fault in document["missions"][-1]["faults"]:
        fault["lasting"] = True
    assert "lasts to the end of its log" in build_fleet_page(document)


def test_an_estimate_that_says_nothing_is_not_drawn_across_the_limit() -> None:
    wide, sure, last = [0, 1.0, 0.19, -0.01, 0.39], [1, 2.0, 0.19, 0.15, 0.23], [2, 3.0, 0.0, -0.2, 0.2]

    def heights(*points: list[float]) -> list[float]:
        drawn = re.search(r'class="sig" d="M([^"]+)"', sparkline({"points": list(points), "limit": 0.1}))  # type: ignore[typeddict-item]
        assert drawn is not None
        return [float(p.split()[1]) for p in drawn[1].split("L")]

    assert len(heights(sure, wide, last)) == 2
    assert len(heights(last, sure, last)) == 2
    assert len(heights(sure, sure, last)) == 3


@pytest.mark.parametrize(("blind", "words"), [((), "Not cleared"), ([("FR", "sensor")], "Not assessed")])
def test_a_mission_that_judged_every_wheel_and_gives_no_leave_is_not_cleared(
    tmp_path: Path, blind: list[tuple[str, str]], words: str
) -> None:
    """As its own report begins: *not assessed* stood beside *no fault found, not cleared*."""
    page = build_fleet_page(document(tmp_path, Sample("a", verdict="not_assessed", blind=blind)))
    row = re.search(r'<tr class="not_assessed">.*?</tr>', page, flags=re.DOTALL)
    assert row
    assert re.search(rf">{words}</span>", row[0])
