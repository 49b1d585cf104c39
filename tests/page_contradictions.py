"""Statements of a mission's page that cannot be true beside each other or its table of coverage."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from diagnosis.comparison.losses import loss_change
from diagnosis.comparison.words import coverage_head
from diagnosis.report.confidence import going_out, judged
from diagnosis.report.fault_times import times_words, when_words
from diagnosis.report.machine_picture import machine_picture
from diagnosis.report.standing import Standing, standings_of
from diagnosis.report.tables import clearing_sentences
from diagnosis.report.timeline import timeline

_END_S = 1.0
_ALL = 0.99


def of_judged(report: Mapping[str, Any]) -> Iterator[str]:
    """How many parts were judged, in title and facts; why none is cleared; one remedy for each reason."""
    verdict = report["verdict"]
    said = judged(report)  # type: ignore[arg-type]
    found = re.match(r"(\d+) of (\d+) parts judged, (none|\d+) cleared", said)
    if found is None:
        return
    whole = found.group(1) == found.group(2)
    if whole and re.search(r"not all parts judged|Not judged long enough", verdict["title"]):
        yield f"title {verdict['title']!r}, and {said!r}"
    if verdict["cleared"] and found.group(3) == "none" and not report["intervals"]:
        yield f"cleared, and {said!r}"
    if said.partition(";")[0].endswith("none cleared"):
        yield f"none cleared without a reason: {said!r}"
    steering = [row for row in verdict["to_clear"] if row["act"].startswith("steer from stop to stop")]
    clauses = [text for row in steering for text in row["reason"].split("; ")]
    silent = [text for text in clauses if "leaves the check" in text]  # nothing deviates there
    judged_too_little = [text for text in clauses if re.search(r"^Not judged: |: judged for ", text)]
    for axle in report["machine"]["axles"]:
        name = re.compile(rf"\b{axle.removesuffix('_steer')}\b", re.IGNORECASE)
        if any(map(name.search, silent)) and any(map(name.search, judged_too_little)):
            yield f"two remedies for the {axle} steering: {sorted({row['act'] for row in steering})}"


def of_going_out(report: Mapping[str, Any]) -> Iterator[str]:
    """The plain answer against the verdict, and reasons that an action says already."""
    answer, _ = going_out(report)  # type: ignore[arg-type]
    verdict = report["verdict"]
    if (answer == "Yes") != verdict["cleared"] and not report.get("previous", {}).get("open_faults"):
        yield f"may it go out again? {answer}, and cleared is {verdict['cleared']}"
    told = [reason for reason, _ in clearing_sentences(verdict)]
    if verdict["actions"] and any(re.match(r"F\d+: ", reason) for reason in told):
        yield "what to do about a fault is said twice"


def of_endings(report: Mapping[str, Any]) -> Iterator[str]:
    """A fault that lasts and is said to have ended, or to have been, and the other way round."""
    end, text = report["log"]["duration_s"], report["verdict"]["text"]
    lasting = [f for f in report["intervals"] if f["stop_s"] >= end - _END_S]
    for fault in report["intervals"]:
        words = when_words(fault, report)  # type: ignore[arg-type]
        if ("lasts to the end" in words) != (fault in lasting):
            yield f"{fault['id']} ends at {fault['stop_s']:.2f} of {end:.2f} s: {words!r}"
    if "to the end of the log" in text and not lasting:
        yield f"nothing lasts to the end: {text!r}"
    stated = [f for f in report["intervals"] if f["severity"] != "info"]
    if stated and all(f in lasting for f in stated) and re.search(r"(sensor|valve|drive|motor) was ", text):
        yield f"every fault lasts to the end: {text!r}"


def of_previous(report: Mapping[str, Any]) -> Iterator[str]:
    """Parts of a comparison that were judged in both missions, below a heading that says one."""
    changes = report.get("previous", {}).get("coverage", [])
    if not changes:
        return
    head = coverage_head(changes)
    both = [c for c in changes if all(side is not None and side["long_enough"] for side in (c["older"], c["newer"]))]
    if both and head == "Judged long enough in one mission only":
        yield f"{head}: {both[0]['component']} {both[0]['side']} was in both"


def of_losses(report: Mapping[str, Any]) -> Iterator[str]:
    """A fault that is called unchanged beside the loss of its part, which grew or shrank."""
    previous = report.get("previous", {})
    for change in previous.get("faults", []):
        if change["status"] != "unchanged" or change["mode"] != "inefficient":
            continue
        for x in previous["loss"]:
            mine = x["component"] == change["component"] and x["side"] in _sides(change)
            if mine and loss_change(x["older"], x["newer"]):
                yield f"{x['component']} {x['side']} is unchanged, and its loss is {x['older']['value']:.2f} and {x['newer']['value']:.2f}"


def of_standings(report: Mapping[str, Any]) -> Iterator[str]:
    """How many parts are cleared: in the facts, the timeline's lanes and the picture of the machine."""
    found = re.match(r"\d+ of \d+ parts judged, (none|\d+) cleared", judged(report))  # type: ignore[arg-type]
    if found is None:
        return
    cleared = 0 if found.group(1) == "none" else int(found.group(1))
    lanes = timeline(report, report["log"]["duration_s"])  # type: ignore[arg-type]
    for lane in lanes.lanes:
        if lane.faulty.endswith("%") and float(lane.faulty.split()[0]) > 100.0:
            yield f"{lane.component} {lane.part} is faulty for {lane.faulty} of the time"
    told = re.search(r"(\d+) cleared", lanes.summary)
    remarked = {(f["component"], side) for f in report["intervals"] if f["severity"] == "info" for side in _sides(f)}
    if (
        not cleared - len(remarked) <= (int(told.group(1)) if told else 0) <= cleared
    ):  # what has a remark has a lane of its own
        yield f"{found.group(0)!r}, and the timeline: {lanes.summary!r}"
    of_lanes = [lane.state for lane in (*lanes.lanes, *lanes.quiet)].count("healthy")
    if of_lanes > cleared:
        yield f"{found.group(0)!r}, and {of_lanes} lanes of the timeline have the symbol of health"
    healthy = machine_picture(report).count(">Healthy<")  # type: ignore[arg-type]
    if 2 * healthy > cleared:
        yield f"{found.group(0)!r}, and the picture calls {healthy} wheels healthy"


def of_reasons(report: Mapping[str, Any]) -> Iterator[str]:
    """Parts that are not cleared while the machine is ready, or of whose component nothing says what is open."""
    standings = standings_of(report)  # type: ignore[arg-type]
    left = [f"{c} {side}" for (c, side), s in standings.items() if s is Standing.NOT_CLEARED]
    rows = report["verdict"]["to_clear"]
    if report["verdict"]["status"] == "ready" and left:
        yield f"ready, and not cleared: {', '.join(left)}"
    if not all(row.get("parts") for row in rows):
        return
    told = {p["component"] for row in rows for p in row["parts"]}
    told |= {f["component"] for f in report["intervals"] if f["severity"] != "info"}
    if untold := [name for name in left if name.partition(" ")[0] not in told]:
        yield f"not cleared, and nothing says why: {', '.join(untold)}"


def _sides(fault: Mapping[str, Any]) -> tuple[str, ...]:
    return ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)


def of_acts(report: Mapping[str, Any]) -> Iterator[str]:
    """What an action says of a fault, and what an open point says of the same one."""
    verdict = report["verdict"]
    repaired = {f for a in verdict["actions"] if "repair" in a["lead"] for f in a["faults"]}
    for row in verdict["to_clear"]:
        for verb, name in re.findall(r"^(repair|check) the [^(]*\((F\d+)\)", row["act"]):
            if (verb == "repair") != (name in repaired):
                yield f"{name} is to be {verb}ed to clear it, and its action is {verdict['actions']!r:.120}"


def of_times(report: Mapping[str, Any]) -> Iterator[str]:
    """What the verdict's sentence says to last to the end of the log, below which an action says when it ended."""
    faults = {f["id"]: f for f in report["intervals"]}
    for action in report["verdict"]["actions"]:
        mine = [faults[f] for f in action["faults"]]
        said = times_words(mine, report)  # type: ignore[arg-type]
        if any("lasts to the end" in when_words(f, report) for f in mine) and "lasts to the end" not in said:  # type: ignore[arg-type]
            yield f"action {action['n']} has a fault that lasts to the end, and says {said!r}"


def of_sizes(report: Mapping[str, Any]) -> Iterator[str]:
    """A loss that is missing, or whose bounds are open, without a reason; one that is known, with one."""
    for fault in report["intervals"]:
        e, total = fault["epsilon"], fault["mode"] in ("stuck", "no_signal")
        if fault["mode"] == "outside_table" and e is not None:
            continue
        open_ = e is None or (e["low"] < _ALL if total else e["low"] <= 0.0 or e["high"] >= 1.0)
        if open_ and not fault["size_note"]:
            yield f"{fault['id']}: nothing says why its ε̂ is {e}"


def of_page(report: Mapping[str, Any]) -> Iterator[str]:
    """All of them."""
    for rule in (
        of_judged,
        of_going_out,
        of_endings,
        of_previous,
        of_losses,
        of_standings,
        of_reasons,
        of_acts,
        of_times,
        of_sizes,
    ):
        yield from rule(report)
