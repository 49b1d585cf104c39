"""The page of a comparison of two missions: one HTML file without scripts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import jinja2

from diagnosis.comparison.words import (
    CHANGES,
    OUTCOMES,
    SIGNS,
    are_several,
    coverage_words,
    headline,
    row_of_found,
    standing,
    times,
)
from diagnosis.pages import labels
from diagnosis.pages.environment import POLICY, environment, plain_style
from diagnosis.pages.svg import icon
from diagnosis.results.comparison_document import (
    ComparedMissionRow,
    ComparisonDocument,
    CoverageChangeRow,
    FaultChangeRow,
    FoundFaultRow,
    MetricChangeRow,
    SideCoverageRow,
)
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Kind, Tier

#: What a template is filled with.
Context = dict[str, object]

_HERE = Path(__file__).parent

_DEFINITIONS = (
    "Faults are matched by component, side and row of the tables; missions differ in time, so times are not compared. All "
    "faults of one component and side in one row count once.",
    "Changed: another row or side, another severity, ε̂ of each mission outside the other's 95 % bounds and 0.05 apart, or time that changed "
    "by more than a factor of two, both in seconds and as a share of the judged time, and by a second at least.",
    "Worse: a higher severity, else a larger ε̂ or more time.",
    "Resolved: not found again although the part was judged long enough in a later, whole mission (with evidence, for the seconds that the "
    "verdict “ready” takes, and for four fifths of its driving), which by its report would have shown such a fault more often than not, "
    "and the part was not healthy again before its mission ended. "
    "Otherwise a missing fault is “not seen again, no repair shown”: what comes and goes is gone at any time.",
    "Tracking error: mean |e| while driving. Control effort: mean |u_a| while driving. Both depend on what was driven.",
)


def build_compare_page(document: ComparisonDocument) -> str:
    """Page of a comparison; the same input gives the same text.

    Parameters
    ----------
    document : ComparisonDocument
        From `diagnosis.comparison.compare.comparison_json`.
    """
    document = labels.made_visible(document)
    groups, machine_words = [], words_of(document)
    for outcome, words in OUTCOMES.items():
        rows = [_row(c, machine_words) for c in document["faults"] if (c["trend"] or c["status"]) == outcome]
        groups.append({"outcome": outcome, "words": words[0].upper() + words[1:], "sign": SIGNS[outcome], "rows": rows})
    context: Context = {
        "title": f"{document['older']['name']} and {document['newer']['name']}",
        "css": plain_style(_HERE / "compare.css"),
        "csp": POLICY,
        "worse": document["worse"],
        "standing": standing(document["counts"]),
        "headline": headline(document["counts"], several=are_several(document["faults"])),
        "missions": [_mission("older", document["older"]), _mission("newer", document["newer"])],
        "groups": groups,
        "coverage": [_coverage(c, machine_words) for c in document["coverage"]],
        "metrics": [_metric(m) for m in document["metrics"]],
        "notes": document["notes"],
        "machine_words": machine_words,
        "definitions": _DEFINITIONS,
    }
    return _environment().get_template("compare.html.j2").render(context)


@lru_cache
def _environment() -> jinja2.Environment:
    found = environment(_HERE)
    found.globals |= {"icon": icon}
    return found


def _mission(word: str, m: ComparedMissionRow) -> Context:
    verdict = m["verdict"]
    machine = " ".join(x for x in (m["machine"], f"({m['machine_id']})" if m["machine_id"] else "") if x)
    return {
        "word": word,
        "name": m["name"],
        "files": ", ".join(m["files"]),
        "when": labels.utc(m["start_ns"]) + " UTC",
        "length": f"{labels.span(m['duration_s'])}, {labels.span(m['driving_s'])} driving",
        "machine": machine,
        "state": verdict.symbol,
        "verdict": verdict.label,
        "title": m["title"] if m["title"].casefold() != verdict.label.casefold() else "",
    }


def _row(c: FaultChangeRow, words: MachineWords) -> Context:
    found = [f for f in (c["older"], c["newer"]) if f is not None]
    rows = dict.fromkeys(row_of_found(f["mode"], f["side"], f.get("rows", ())) for f in found)
    return {
        "part": words.part_words(c["kind"], c["component"], c["side"]),
        "rows": list(rows),
        "older": _found(c["older"], c["kind"], words),
        "newer": _found(c["newer"], c["kind"], words),
        "changed": ", ".join(CHANGES[name] for name in c["changes"]),
        "note": c["note"],
    }


def _found(f: FoundFaultRow | None, kind: Kind, words: MachineWords) -> dict[str, str] | None:
    if f is None:
        return None
    e = f["epsilon"]
    epsilon = "" if e is None or f["mode"].total else f"ε̂ {e['value']:.2f} ({e['low']:.2f}–{e['high']:.2f})"
    return {
        "severity": f["severity"],
        "times": times(len(f["ids"]), f["seconds"]),
        "epsilon": epsilon,
        "more": f"{', '.join(_few(f['ids']))}; {min(100 * f['probability'], 99.9):.1f} % sure; {words.evidence(Tier(f['tier']), Kind(kind))}",
    }


def _few(ids: Sequence[str]) -> list[str]:
    return [*ids[:4], "…"] if len(ids) > 4 else list(ids)


def _coverage(c: CoverageChangeRow, words: MachineWords) -> Context:
    return {
        "part": words.part_words(c["kind"], c["component"], c["side"]),
        "change": c["change"],
        "words": coverage_words(c),
        "older": _judged(c["older"], c["kind"], words),
        "newer": _judged(c["newer"], c["kind"], words),
    }


def _judged(side: SideCoverageRow | None, kind: Kind, words: MachineWords) -> str:
    if side is None:
        return "not in the result"
    if side["tier"] is Tier.NONE:
        return "no evidence"
    return f"{side['decided_s']:.1f} of {side['driving_s']:.1f} s, {words.evidence(Tier(side['tier']), Kind(kind))}"


def _metric(m: MetricChangeRow) -> Context:
    pairs = (
        (m["tracking_error_older"], m["tracking_error_newer"]),
        (m["control_effort_older"], m["control_effort_newer"]),
    )
    cells: list[str] = []
    for (a, b), scale, digits in zip(pairs, (1.0, 100.0), (3, 1), strict=True):
        change = f"{round(100 * (b / a - 1)):+d} %".replace("-", "−") if a and b is not None else ""
        cells += [*("–" if x is None else f"{scale * x:.{digits}f}" for x in (a, b)), change]
    return {"wheel": m["wheel"], "cells": cells}
