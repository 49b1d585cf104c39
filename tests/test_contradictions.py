"""No result and no fleet says two things that cannot both be true: missions with many faults, fleets, and the checkers themselves."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from numpy.typing import NDArray

from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.vocabulary import Verdict
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission
from tests import fleet_samples as samples
from tests import report_samples
from tests.campaigns import campaign_of_rows
from tests.clearing_contradictions import of_detectability
from tests.contradictions import contradictions
from tests.coverage_changes import changed_coverage, judged_side
from tests.fleet_contradictions import fleet_contradictions
from tests.page_contradictions import of_reasons
from tests.sentence_contradictions import of_kinds, of_lengths
from tests.whole_documents import whole_report

Document = dict[str, Any]
Columns = dict[str, NDArray[Any]]


@cache
def diagnosed(evidence: EvidenceLevel, seed: int) -> tuple[Document, Columns]:
    options = SimulationOptions(
        scenario="random", seed=seed, duration_s=60.0, rate_hz=200.0, evidence=evidence, steering_faults=True
    )
    made = simulate_mission(options)
    items = {
        n: Signal(n, made.stamps, x, SignalSource(column=n), "a.mcap", guessed=False) for n, x in made.columns.items()
    }
    signals = Signals(items, {})
    result = diagnose_mission(Mission((), signals, align(signals)), haulotte())
    return orjson.loads(orjson.dumps(result.report)), dict(result.columns)


@pytest.fixture(scope="module")
def result() -> tuple[Document, Columns]:
    return diagnosed("direct", 2)


@pytest.mark.parametrize(
    ("evidence", "seed"), campaign_of_rows([("base", 1), ("spool", 2000), ("direct", 2), ("direct", 2000)], 3)
)
def test_missions_with_many_faults_do_not_contradict_themselves(evidence: EvidenceLevel, seed: int) -> None:
    found, columns = diagnosed(evidence, seed)
    assert len(found["intervals"]) > 5
    assert contradictions(found, columns) == []


def _first(d: Document, severity: str) -> Document:
    return next(f for f in d["intervals"] if f["severity"] == severity)  # type: ignore[no-any-return]


def _calm(d: Document) -> None:
    d["verdict"]["status"] = "ready"


def _advice(d: Document) -> None:
    _first(d, "high")["advice"] = "Nothing to do."


def _minority(d: Document) -> None:
    fault = _first(d, "high")
    fault["mode"] = "noisy"


def _size(d: Document) -> None:
    next(f for f in d["intervals"] if f["epsilon"])["epsilon"]["value"] = 1.7


def _late(d: Document) -> None:
    d["intervals"][0]["detected_s"] = d["intervals"][0]["stop_s"] + 3.0


def _softer(d: Document) -> None:
    _first(d, "high")["severity"] = "low"


def _healthy(d: Document) -> None:
    for s in d["states"]:
        s["state"] = "healthy"


def _untold(d: Document) -> None:
    d["verdict"]["actions"] = d["verdict"]["actions"][1:]


def _sum(d: Document) -> None:
    d["intervals"][0]["hypotheses"][0]["p"] = 0.2


def _unmoved(d: Document) -> None:
    for s in d["states"]:
        s["state"] = "not_excited"


def _moment(d: Document) -> None:
    fault = _first(d, "high")
    window = f"{fault['start_s'] - 2.9:.1f}–{fault['start_s'] + 0.1:.1f} s"
    reason = f"At the time of {fault['id']}, which may explain it: the speed of FR changes quickly, in the mean of 3 s by 20 % of itself at {window}."
    d["verdict"]["to_clear"].append({"reason": reason, "act": "repair it"})


def _not_judged(d: Document) -> None:
    d["verdict"]["title"] = "No fault found, not all parts judged"
    for row in d["coverage"]:
        row["decided_driving_s"], row["tier"] = row["driving_s"] + 20.0, "direct"
        row["driving_s"] += 20.0


def _lasting(d: Document) -> None:
    d["verdict"]["text"] += " It lasts to the end of the log."
    for f in d["intervals"]:
        f["stop_s"] = min(f["stop_s"], d["log"]["duration_s"] - 3.0)


def _in_both(d: Document) -> None:
    d["previous"] = {
        "coverage": [changed_coverage(judged_side())],
        "order": "earlier",
        "mission": {"files": ["a.mcap"]},
        "counts": {},
        "faults": [],
    }


def _two_remedies(d: Document) -> None:
    at_rest = "steer from stop to stop twice at standstill, and watch whether the axle follows"
    d["verdict"]["to_clear"] += [
        {
            "reason": "Front steering valve: this mission leaves the check “against its second measurement” open.",
            "act": at_rest,
        },
        {
            "reason": "Not judged: front steering valve (steered too little).",
            "act": "steer from stop to stop several times while driving",
        },
    ]


def _other_act(d: Document) -> None:
    act = f"check the part ({_first(d, 'high')['id']}) and repair what is found, then diagnose the next mission"
    d["verdict"]["to_clear"].append({"reason": "It deviates.", "act": act, "parts": [], "fault": "", "why": ""})


def _logged_already(d: Document) -> None:
    act = "inspect these parts, and log wheel.*.v (a speed)"
    parts = [{"component": "FR", "side": "sensor"}]
    d["verdict"]["to_clear"].append({"reason": "It deviates.", "act": act, "parts": parts, "fault": "", "why": ""})


def _no_reason(d: Document) -> None:
    fault = next(f for f in d["intervals"] if f["mode"] == "inefficient")
    fault["epsilon"]["low"] = 0.0


def _unfilled(d: Document) -> None:
    d["intervals"][0]["evidence"].append("It stayed there for {2.97 s}.")


def _longer(d: Document) -> None:
    d["intervals"][0]["evidence"].append("Over 2000 s it fits.")


@pytest.mark.parametrize(
    "spoil",
    [
        *(
            _calm,
            _advice,
            _minority,
            _size,
            _late,
            _softer,
            _healthy,
            _untold,
            _sum,
            _unmoved,
            _moment,
        ),
        *(_not_judged, _lasting, _in_both, _two_remedies, _other_act, _no_reason, _logged_already, _unfilled, _longer),
    ],
)
def test_a_spoilt_result_is_seen(result: tuple[Document, Columns], spoil: Callable[[Document], None]) -> None:
    document, _ = result
    changed = copy.deepcopy(document)
    spoil(changed)
    assert contradictions(changed) != []


def test_a_fault_that_its_heading_alone_calls_unclear_is_seen(result: tuple[Document, Columns]) -> None:
    document = copy.deepcopy(result[0])
    assert list(of_kinds(document)) == []
    fault = next(f for f in document["intervals"] if f["severity"] != "info")
    rows = zip(("noisy", "stuck", "no_signal"), (0.4, 0.35, 0.25), strict=True)
    fault["hypotheses"] = [{"side": fault["side"], "mode": m, "p": p} for m, p in rows]
    assert len(list(of_kinds(document))) == 1


def test_a_sentence_on_a_time_longer_than_its_fault_is_seen(result: tuple[Document, Columns]) -> None:
    document = copy.deepcopy(result[0])
    assert list(of_lengths(document)) == []
    document["intervals"][0]["evidence"].append(
        "wheel.FR.v followed 0.7 × what it should, over 44.62 s; the rest is noise."
    )
    assert len(list(of_lengths(document))) == 1


def test_a_fault_of_no_size_that_would_show_is_seen() -> None:
    document: Document = whole_report(report_samples.no_faults()[0])  # type: ignore[assignment]
    assert list(of_detectability(document)) == []
    row = {"component": "FR", "side": "sensor", "deviation": "excess", "for_s": None, "size": 0.0}
    document["detectability"]["rows"].append(row)
    (said,) = of_detectability(document)
    assert said == "FR sensor: a fault of no size would show (excess throughout), and nothing deviates"


def test_a_part_that_is_not_cleared_without_a_reason_is_seen() -> None:
    made, _ = report_samples.no_faults()
    document: Document = whole_report(made)  # type: ignore[assignment]
    document["verdict"] |= {"status": "ready", "cleared": True, "to_clear": []}
    assert list(of_reasons(document)) == []
    row = {"component": "FR", "side": "actuator", "deviation": "excess", "for_s": None, "size": 0.0}
    document["detectability"]["rows"].append(row)
    ready, untold = of_reasons(document)
    assert ready == "ready, and not cleared: FR actuator"
    assert untold == "not cleared, and nothing says why: FR actuator"


def _another_loss(d: Document, columns: Columns) -> None:
    fault = _first(d, "high")
    name = f"evidence.{fault['component']}.{fault['side']}.epsilon"
    columns[name] = columns[name] - 0.2


def _narrow_band(d: Document, columns: Columns) -> None:
    fault = next(f for f in d["intervals"] if f["epsilon"] and f["epsilon"]["high"] - f["epsilon"]["low"] > 0.01)
    base = f"evidence.{fault['component']}.{fault['side']}."
    columns[base + "epsilon_low"] = columns[base + "epsilon"]


def _loss_while_healthy(d: Document, columns: Columns) -> None:
    span = next(s for s in d["states"] if s["state"] == "healthy" and s["stop_s"] - s["start_s"] > 5.0)
    name = f"evidence.{span['component']}.{span['side']}.epsilon"
    columns[name] = np.where(np.isfinite(columns[name]), 0.9, np.nan)


def _loss_while_unknown(d: Document, columns: Columns) -> None:
    name = next(n for n, x in columns.items() if n.endswith(".epsilon") and np.isnan(x).any())
    columns[name] = np.nan_to_num(columns[name])


def _sure_of_health(d: Document, columns: Columns) -> None:
    names = [f"evidence.{f['component']}.{f['side']}.probability" for f in d["intervals"] if f["severity"] == "high"]
    name = next(n for n in names if n in columns)
    columns[name] = np.zeros_like(columns[name])


def _healthy_modes(d: Document, columns: Columns) -> None:
    names = [f"evidence.{f['component']}.{f['side']}.p_healthy" for f in d["intervals"] if f["severity"] == "high"]
    name = next(n for n in names if n in columns)
    columns[name] = np.ones_like(columns[name])


@pytest.mark.parametrize(
    "spoil", [_another_loss, _narrow_band, _loss_while_healthy, _loss_while_unknown, _sure_of_health, _healthy_modes]
)
def test_plots_that_show_something_else_than_the_findings_are_seen(
    result: tuple[Document, Columns], spoil: Callable[[Document, Columns], None]
) -> None:
    document, columns = result
    changed = dict(columns)
    spoil(document, changed)
    assert contradictions(document, changed) != []


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetDocument:
    folder = tmp_path_factory.mktemp("fleet")
    return fleet_json(load_fleet(samples.write_store(folder / "fleet.sqlite", samples.few())))


@pytest.mark.parametrize("axis", ["hours", "days"])
@pytest.mark.parametrize("missions", [samples.few, samples.hostile])
def test_fleets_do_not_contradict_themselves(
    tmp_path: Path, missions: Callable[[], list[samples.Sample]], axis: Axis
) -> None:
    document = fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions()), axis=axis))
    assert any(t["forecast"]["state"] != "not_known" for t in document["trends"]) == (missions is samples.few)
    assert fleet_contradictions(document) == []


def _two_states(d: FleetDocument) -> None:
    next(m for m in d["machines"] if m["verdict"] == "ready")["verdict"] = Verdict.NOT_ASSESSED


def _other_number(d: FleetDocument) -> None:
    d["verdict"]["title"] = "3 of 8 machines must not go out, 4 may go out, 1 must be checked first"


def _other_list(d: FleetDocument) -> None:
    label = next(m["label"] for m in d["machines"] if m["verdict"] == "ready")
    d["verdict"]["text"].append(f"Must not go out (4): {label}.")


def _other_axis(d: FleetDocument) -> None:
    d["axis"] = "days"  # and all that was worded still says hours


@pytest.mark.parametrize("spoil", [_two_states, _other_number, _other_list, _other_axis])
def test_a_spoilt_fleet_is_seen(fleet: FleetDocument, spoil: Callable[[FleetDocument], None]) -> None:
    assert fleet_contradictions(fleet) == []
    changed = copy.deepcopy(fleet)
    spoil(changed)
    assert fleet_contradictions(changed) != []
