"""What a reader looks for on the first screen: which drives were measured twice, which law the replay rests on, which part to leave alone."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.comparison.coverage import sides_of
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Kind, Severity
from replay.control.law_choice import UNEXPLAINED
from replay.faults import Side, State

_HARDLY = 0.05  # probability of the other part of a component that is worth no word


def positions_fact(report: ReportDocument) -> tuple[str, str] | None:
    """Of which drives the position, or what else carries out their command, is in the log, and of which not; None where drives have none."""
    machine, words = report["machine"], words_of(report["machine"])
    if words.drive == "motor":
        return None
    logged = {s["name"] for s in report["signals"]}
    parts = [(Kind.WHEEL, c) for c in machine["wheels"]] + [(Kind.STEER, c) for c in machine["axles"]]
    named = {
        there: " and ".join(
            words.listed(kind, [(c, Side.ACTUATOR) for c in own])
            for kind in (Kind.WHEEL, Kind.STEER)
            if (own := [c for k, c in parts if k is kind and (f"{k}.{c}.u_applied" in logged) is there])
        )
        for there in (True, False)
    }
    if not named[True]:
        return f"{words.position.capitalize()}s measured", "none: a loss is judged by a model, or beside other parts"
    rest = f"; not measured: {named[False]} (judged by a model, or beside other parts)" if named[False] else ""
    return f"{words.position.capitalize()}s measured", f"{named[True]}{rest}"


def law_doubt(report: ReportDocument) -> str:
    """What must be known before replayed curves are compared with recorded ones: that the law hardly explains them; mostly empty."""
    detail = next((r["detail"] for r in report["readings"] if UNEXPLAINED in r["detail"]), "")
    explained = next((x.strip() for x in detail.split(";") if "explains" in x and "recorded command" in x), "")
    if not detail:
        return ""
    return (
        f"The control law of the replay does not fit this machine ({explained or UNEXPLAINED}): replayed commands and Ψ̂ are not what its own "
        "controller would have given, and a difference to the recorded ones is no fault."
    )


def other_side_words(faults: Sequence[IntervalRow], report: ReportDocument) -> str:
    """That nothing speaks against the other part of a faulty component, so that nobody changes it; empty where something may.

    It was judged as long as a verdict of *ready* takes, no fault of it is stated, no explanation of the faults names it, and it stands in nothing
    that is open but what a fault of another part explains.
    """
    first, sides = faults[0], sides_of(report)
    other = {Side.SENSOR: Side.ACTUATOR, Side.ACTUATOR: Side.SENSOR}.get(Side(first["side"]))
    part = (first["component"], other.value) if other else None
    if part is None or other is None or part not in sides or not sides[part].long_enough:
        return ""
    own = [f for f in report["intervals"] if f["component"] == first["component"]]
    if any(other in Side(f["side"]).sides for f in own):
        return ""
    if any(_against(f, other) >= _HARDLY for f in own if f["severity"] != Severity.INFO):
        return ""
    for row in report["verdict"].get("to_clear", ()):
        named = any((p["component"], p["side"]) == part for p in row.get("parts", ()))
        if (named or "parts" not in row) and not row["reason"].startswith("Explained by "):
            return ""
    name = words_of(report["machine"]).part_words(first["kind"], *part)
    return f"Nothing was found against the {name}: this mission gives no reason to change it"


def _against(fault: IntervalRow, side: Side) -> float:
    """Probability of all explanations of a fault that name a side."""
    return sum(
        h["p"]
        for h in fault["hypotheses"]
        if h["mode"] != State.HEALTHY and h["side"] in set(Side) and side in Side(h["side"]).sides
    )
