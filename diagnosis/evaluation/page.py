"""The page of an evaluation: one HTML file without scripts that shows what was right, wrong, missed and late."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal, TypedDict

import jinja2
from markupsafe import Markup

from diagnosis.evaluation.document import (
    BandFigures,
    EventFigures,
    FaultRow,
    Figures,
    MissionFigures,
    Reliability,
    ReportRow,
    ResultRow,
    ScoresDocument,
    SideFigures,
    Spread,
)
from diagnosis.evaluation.plots import distribution, reliability_diagram
from diagnosis.pages import labels
from diagnosis.pages.environment import POLICY, environment, plain_style
from diagnosis.pages.svg import icon
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import ANY_DRIVE

_HERE = Path(__file__).parent

_Group = Literal["wheel", "steer"]
_Time = Literal["detection_delay_s", "onset_error_s", "end_error_s"]
_TITLES: dict[_Group, str] = {"wheel": "Wheels", "steer": "Steering"}
_TIMES: dict[_Time, str] = {
    "detection_delay_s": "Detection delay",
    "onset_error_s": "Onset error",
    "end_error_s": "End error",
}
_OUTCOMES = {
    "missed": ("○", "missed"),
    "wrong_mode": ("✗", "right part, wrong row"),
    "wrong_side": ("✗", "right component, wrong side"),
    "wrong_part": ("✗", "reported on another component"),
    "surplus": ("+", "reported without a matching fault"),
    "false_alarm": ("!", "false alarm"),
}
_OPEN = 5
_DEFINITIONS = (
    "Driving: the true commanded speed of the wheel exceeds the truth's driving speed. An actuator behind a sensor that is "
    "stuck or silent is masked: that time and its reports count in their own row only.",
    "Macro-F1 and balanced accuracy are means over the rows that occur, weighted with time; undecided time counts as wrong. "
    "The second balanced accuracy is over decided time alone.",
    "A reported fault and an injected one match one to one where their intervals overlap by at least 0.3 (intersection over "
    "union); right means component, side and row. There is no point adjustment: a part of a fault does not count as the whole fault.",
    "“Sensor or actuator” is right for inefficient faults alone, which cannot be distinguished in steady state.",
    "Onset error: reported start − first excited sample of the fault. End error: reported − true end. Both are "
    "absolute values of the final report, over right faults.",
    "Detection delay: moment of detection − first excited sample, over faults reported on their own component. The moment of "
    "detection is the first at which the evidence up to then raises the fault, to its end or for at least 0.1 s. It is the "
    "detection time t_dt of DAMADICS. Noise and delays of the channels are those of the whole mission.",
    "Isolated: share of the faults for which something was reported that named the right component and side.",
    "False alarms: reports that are not right and whose component has no fault for more than half of their time, without "
    "those of severity info; per hour without a fault, with the upper 95 % bound of a Poisson count.",
    "r_fd, r_td, r_fi, r_ti: false and true detection rate, false and true isolation rate of DAMADICS, over driving time.",
    "ε error: mean |ε̂ − ε| over right faults.",
)


class _WrongRow(TypedDict):
    """A line of the list of what was not right."""

    start: float
    time: str
    state: str
    part: str
    sign: str
    outcome: str
    report: str
    more: str


def build_scores_page(document: ScoresDocument) -> str:
    """Page of an evaluation; the same input gives the same text.

    Parameters
    ----------
    document : ScoresDocument
        What `mfhca evaluate --json` prints: ``results`` with the faults and reports of each, and the figures of
        ``all``.
    """
    document = labels.made_visible(document)
    results = document["results"]
    groups = [_group(key, document["all"][key], results) for key in _TITLES if key in document["all"]]
    left_out = [f"{r['result']}: {', '.join(r['left_out'])}" for r in results if r["left_out"]]
    count = f"{labels.grouped(len(results))} mission{'s' if len(results) != 1 else ''}"
    context = {
        "title": f"Evaluation of {count}",
        "css": plain_style(_HERE / "scores.css"),
        "csp": POLICY,
        "count": count,
        "groups": groups,
        "left_out": left_out,
        "not_driven": [f"{r['result']}: {', '.join(r['not_driven'])}" for r in results if r["not_driven"]],
        "missions": _missions(results),
        "definitions": _DEFINITIONS,
    }
    return _environment().get_template("scores.html.j2").render(context)


@lru_cache
def _environment() -> jinja2.Environment:
    found = environment(_HERE)
    found.filters |= {"num": labels.number, "share": _share, "both": _both, "state": state_label}
    found.globals |= {"icon": icon, "known": labels.known}
    return found


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _time(seconds: float | None) -> str:
    return "–" if seconds is None else labels.span(abs(seconds)) if seconds >= -5e-4 else f"−{labels.span(-seconds)}"


def _faults(count: int) -> str:
    return f"{count} fault{'s' if count != 1 else ''}"


def _both(e: Spread) -> str:
    """Median and 95 % quantile of a time in one unit."""
    if e["median"] is None or e["p95"] is None:
        return "–"
    scale, unit = (1e3, "ms") if max(abs(e["median"]), abs(e["p95"])) < 1 else (1.0, "s")
    return " / ".join(labels.number(round(scale * x, 2)) for x in (e["median"], e["p95"])) + f" {unit}"


def _group(key: _Group, figures: Figures, results: Sequence[ResultRow]) -> dict[str, object]:
    """What the page shows of wheels or of steering."""
    title = _TITLES[key]
    return {
        "title": title,
        "figures": figures,
        "shown": bool(figures["events"]["faults"] or figures["events"]["masked"] or figures["events"]["reported"]),
        "kpis": list(_kpis(figures)),
        "confusions": [(side, _confusion(values, side)) for side, values in figures["sides"].items()],
        "by_epsilon": [(f"ε {_band(b)}", b) for b in figures["by_epsilon"]],
        "by_speed": [(f"{_band(b)} m/s", b) for b in figures["by_speed"]],
        "by_contact": [(b["contact"], b) for b in figures["by_contact"]],
        "plots": list(_plots(title, [f for r in results if key in r for f in r[key]["faults"]], figures)),
        "reliability": [_reliability(r) for r in figures["reliability"] if r["reported"]],
    }


def _kpis(figures: Figures) -> Iterator[tuple[str, str, str]]:
    """Name, value and what belongs to it of the leading figures."""
    for side, s in figures["sides"].items():
        rates = s["damadics"]
        more = f"balanced accuracy {_share(s['balanced_accuracy'])}, of decided time {_share(s['balanced_accuracy_decided'])}"
        yield f"macro-F1, {side}", _share(s["macro_f1"]), f"{more}; undecided {_share(s['undecided_share'])}"
        yield (
            f"true detection r_td, {side}",
            _share(rates["r_td"]),
            f"false r_fd {_share(rates['r_fd'])}; isolation true r_ti {_share(rates['r_ti'])}, false r_fi {_share(rates['r_fi'])}",
        )
    events, alarms, epsilon = figures["events"], figures["false_alarms"], figures["epsilon"]
    bound = f"at most {labels.number(alarms['per_hour_high'])} (95 %); {alarms['count']} in {alarms['healthy_h']:.3f} h"
    yield "false alarms per healthy hour", labels.number(alarms["per_hour"]), bound
    if not events["faults"]:
        return
    more = f"precision {_share(events['precision'])}, recall {_share(events['recall'])}"
    yield "events, F1", _share(events["f1"]), f"{events['right']} of {events['faults']} right; {more}"
    more = (
        f"right row too {_share(events['identification_rate'])}, other component {_share(events['wrong_wheel_rate'])}"
    )
    yield "isolated, of detected", _share(events["isolation_rate"]), more
    for key, title in _TIMES.items():
        e = figures[key]
        yield f"{title.lower()}, median", _time(e["median"]), f"95 %: {_time(e['p95'])}, over {_faults(e['n'])}"
    more = f"over {_faults(epsilon['n'])}; partial faults (0 < ε < 1) {_share(epsilon['mae_partial'])}"
    yield "error of ε̂, mean", _share(epsilon["mae"]), more


def _band(b: BandFigures) -> str:
    return f"from {b['low']:g}" if b["high"] is None else f"{b['low']:g}–{b['high']:g}"


def _confusion(side_figures: SideFigures, side: str) -> dict[str, object]:
    """Rows that occur, each cell with its share of the row, its seconds and its colour."""
    rows = []
    for name, seconds in zip(side_figures["true"], side_figures["seconds"], strict=True):
        total = sum(seconds)
        if total > 0:
            cells = [
                _cell(name, other, s, s / total) for other, s in zip(side_figures["reported"], seconds, strict=True)
            ]
            rows.append({"state": name, "words": state_label(name, side), "cells": cells})
    short = {"outside_table": "Outside", "undecided": "Undecided"}
    columns = [short.get(c) or state_label(c, side) for c in side_figures["reported"]]
    return {"columns": columns, "rows": rows}


def _cell(true: str, reported: str, seconds: float, share: float) -> dict[str, object]:
    if seconds <= 0:
        return {"kind": "none", "colour": ""}
    kind, sign, colour = ("right", "✓", "--accent") if true == reported else ("wrong", "✗", "--stuck")
    if reported == "undecided":
        kind, sign, colour = "open", "?", "--peer"
    percent = "<0.1 %" if share < 5e-4 else f"{100 * share:.1f} %"
    words = f"{labels.number(seconds, 4 if seconds >= 100 else 3)} s"
    return {
        "kind": kind,
        "sign": sign,
        "share": percent,
        "seconds": words,
        "colour": colour,
        "depth": round(6 + 38 * share),
    }


def _plots(title: str, faults: Sequence[FaultRow], figures: EventFigures) -> Iterator[tuple[str, Markup, str]]:
    """Title, picture and words of each distribution of times."""
    for key, name in _TIMES.items():
        values = {
            side: [seconds for f in faults if f["side"] == side and (seconds := f[key]) is not None]
            for side in ("sensor", "actuator")
        }
        plot = distribution(f"{title}: {name.lower()}", values)
        if plot:
            e = figures[key]
            words = f"Median {_time(e['median'])}, 95 % {_time(e['p95'])}, over {_faults(e['n'])}"
            missing = figures["detection_delay_s"]["without"] if key == "detection_delay_s" else 0
            yield name, plot, words + (f"; {missing} more without a known moment." if missing else ".")


def _reliability(r: Reliability) -> dict[str, object]:
    title = "all reports" if r["tier"] == "all" else f"{r['tier']}, {r['side'].replace('_', ' ')}"
    words = f"{r['right']} of {r['reported']} right; Brier {_share(r['brier'])}, ECE {_share(r['ece'])}"
    if r["bounds"]:
        words += f"; 95 % bounds of ε hold the truth of {_share(r['bounds_hold'])} of {r['bounds']}"
    return {"title": title, "words": words, "plot": reliability_diagram(title, r["bins"])}


def _missions(results: Sequence[ResultRow]) -> list[dict[str, object]]:
    """Faults that were not found as they are and reports without a fault of their own, by mission and time."""
    out = []
    for result in results:
        rows = [row for key in _TITLES if key in result for row in _wrong(key, result[key])]
        rows.sort(key=lambda r: (r["start"], r["part"]))
        events = [result[key]["events"] for key in _TITLES if key in result]
        faults, right = sum(e["faults"] for e in events), sum(e["right"] for e in events)
        false = sum(r["sign"] == "!" for r in rows)
        words = f"{right} of {faults} right, {false} false alarm{'s' if false != 1 else ''}"
        out.append(
            {"name": result["result"], "words": words, "rows": rows, "open": bool(rows) and len(results) <= _OPEN}
        )
    return out


def _wrong(kind: str, group: MissionFigures) -> Iterator[_WrongRow]:
    reports = {r["id"]: r for r in group["reported"]}
    for f in group["faults"]:
        if f["outcome"] in ("missed", "wrong_mode", "wrong_side", "wrong_part"):
            r = reports.get(f["report"])
            reported = f"reported as {_part(kind, r)}, {r['start_s']:.2f}–{r['stop_s']:.2f} s" if r else ""
            yield _row(
                kind, f, f["outcome"], f["report"], f"ε {f['epsilon']:.2f}" + (f"; {reported}" if reported else "")
            )
    for r in group["reported"]:
        if r["false_alarm"] or r["outcome"] == "surplus":
            outcome = "false_alarm" if r["false_alarm"] else "surplus"
            more = f"probability {r['probability']:.2f}, severity {r['severity']}, tier {r['tier'] or 'unknown'}"
            yield _row(kind, r, outcome, r["id"], more)


def _row(kind: str, x: FaultRow | ReportRow, outcome: str, report: str, more: str) -> _WrongRow:
    sign, words = _OUTCOMES[outcome]
    return {
        "start": x["start_s"],
        "time": f"{x['start_s']:.2f}–{x['stop_s']:.2f}",
        "state": labels.known(x["mode"]),
        "part": _part(kind, x),
        "sign": sign,
        "outcome": words,
        "report": report,
        "more": more,
    }


def _part(kind: str, x: FaultRow | ReportRow) -> str:
    return f"{x['component']} {ANY_DRIVE.part_name(kind, x['side'])} {state_label(x['mode'], x['side']).lower()}"
