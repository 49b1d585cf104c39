"""Words of the section that compares a mission with another one of the same machine."""

from __future__ import annotations

from diagnosis.comparison.losses import loss_change
from diagnosis.comparison.words import CHANGES, OUTCOMES, SIGNS, coverage_head, coverage_words, row_of_found, times
from diagnosis.pages import labels
from diagnosis.report.judged_parts import kind_of
from diagnosis.report.tables import Context
from diagnosis.results.comparison_document import (
    CoverageChangeRow,
    FaultChangeRow,
    FoundFaultRow,
    LossChangeRow,
    OtherMissionRow,
    SideCoverageRow,
)
from diagnosis.results.document import MachineRow, ReportDocument
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.vocabulary import Tier, Verdict
from replay.faults import FaultMode

_BAD = ("new", "worse")


def previous_section(report: ReportDocument) -> Context | None:
    """Everything that the section shows, None where the report holds no comparison.

    Parameters
    ----------
    report : ReportDocument
        The document with names made visible.
    """
    found = report.get("previous")
    if found is None:
        return None
    later, words = found["order"] == "later", words_of(report["machine"])
    counts = {name: n for name, n in found["counts"].items() if name in OUTCOMES and n}
    short = [f"{n} {'not seen again' if k == 'not_seen_again' else OUTCOMES[k]}" for k, n in counts.items()]
    return {
        "title": "Against a later mission" if later else "Against the previous mission",
        "heads": ["This mission", "Later mission"] if later else ["Previous mission", "This mission"],
        "own": 0 if later else 1,
        "later": later,
        "mission": _mission(found["mission"]),
        "counts": [(SIGNS[name], OUTCOMES[name], n, name in _BAD) for name, n in counts.items()],
        "short": ", ".join(short) or "no fault in either",
        "faults": [_row(c, words) for c in found["faults"]],
        "coverage": [_coverage(c, words) for c in found["coverage"]],
        "coverage_head": coverage_head(found["coverage"]),
        "loss": [_loss(x, report["machine"]) for x in found["loss"] if loss_change(x["older"], x["newer"])],
        "same_loss": sum(not loss_change(x["older"], x["newer"]) for x in found["loss"]),
        "notes": found["notes"],
        "open_faults": found.get("open_faults", []),
        "open_asof": labels.utc_moment(found["open_asof_ns"])[:10] if "open_asof_ns" in found else "",
    }


def _mission(m: OtherMissionRow) -> Context:
    verdict = Verdict(m["verdict"])
    return {
        "state": verdict.symbol,
        "verdict": verdict.label,
        "files": " + ".join(m["files"]) or "no log named",
        "when": f"{labels.utc(m['start_ns'])} UTC",
        "length": f"{labels.span(m['duration_s'])}, {labels.span(m['driving_s'])} driving",
    }


def _row(c: FaultChangeRow, words: MachineWords) -> Context:
    outcome = c["trend"] or c["status"]
    both = [c["older"], c["newer"]]
    modes = dict.fromkeys(row_of_found(f["mode"], f["side"], f.get("rows", ())) for f in both if f)
    changes = ", ".join(CHANGES[n] for n in c["changes"])
    return {
        "sign": SIGNS[outcome],
        "outcome": OUTCOMES[outcome],
        "bad": outcome in _BAD,
        "part": words.part_words(c["kind"], c["component"], c["side"]),
        "modes": list(modes),
        "cells": [_found(f) for f in both],
        "ids": [f["ids"][:3] if f else [] for f in both],
        "more": "; ".join(x for x in (changes, c["note"]) if x),
    }


def _found(f: FoundFaultRow | None) -> str:
    if f is None:
        return "–"
    e = f["epsilon"]
    size = "" if e is None or FaultMode(f["mode"]).total else f", ε̂ {_epsilon(e)}"
    return (
        f"{f['severity']}, {times(len(f['ids']), f['seconds'])}, {min(100 * f['probability'], 99.9):.0f} % sure{size}"
    )


def _epsilon(e: EpsilonRow) -> str:
    return f"{e['value']:.2f} ({e['low']:.2f}–{e['high']:.2f})"


def _coverage(c: CoverageChangeRow, words: MachineWords) -> Context:
    return {
        "part": words.part_words(c["kind"], c["component"], c["side"]),
        "lost": c["change"] == "lost",
        "words": coverage_words(c),
        "cells": [_judged(c["older"]), _judged(c["newer"])],
    }


def _judged(side: SideCoverageRow | None) -> str:
    if side is None:
        return "not in the result"
    if side["tier"] == Tier.NONE:
        return "no evidence"
    return f"{side['decided_s']:.1f} of {side['driving_s']:.1f} s driving" + (
        ", a check open" if not side["shown"] else ""
    )


def _loss(x: LossChangeRow, machine: MachineRow) -> Context:
    change = x["newer"]["value"] - x["older"]["value"]
    return {
        "part": words_of(machine).part_words(kind_of(x["component"], machine), x["component"], x["side"]),
        "cells": [labels.bounded(x["older"]), labels.bounded(x["newer"])],
        "change": f"{change:+.3f}".replace("-", "−"),
    }
