"""Statements of a fleet's page, table and lists that cannot be true beside each other."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.leave import GONE, lists_of
from diagnosis.audit.fleet.listed import listed_machines
from diagnosis.audit.fleet.page.page import build_fleet_page
from diagnosis.audit.fleet.page.trends import chosen, dead_words
from diagnosis.audit.fleet.table import fleet_csv
from diagnosis.audit.fleet.trend_types import TrendRow
from diagnosis.audit.fleet.words import TICK_UNITS
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.vocabulary import Leave, Verdict

_UNITS = {"hours": ("h of driving",), "days": ("days", "day")}


def fleet_contradictions(document: FleetDocument) -> list[str]:
    """One sentence for each contradiction in a ``fleet.json`` and what is made of it; empty where there is none."""
    checks = (_lists, _headline, _counts, _table, _endings, _words, _units)
    return [text for check in checks for text in check(document)]


def _lists(document: FleetDocument) -> Iterator[str]:
    """Each machine in one list, with a state that goes with it."""
    lists, machines = lists_of(document), listed_machines(document)
    if [x.machine for x in lists] != list(range(len(document["machines"]))):
        yield "a machine stands in no list, or in two"
    for left, machine in zip(lists, machines, strict=True):
        if document["machines"][left.machine].get("cleared") != (left.leave is Leave.MAY):
            yield f"{left.label}: cleared in the list {left.leave!r}"
        ready = machine.words.startswith("Ready") and "but a loss" not in machine.words
        if ready != (left.leave is Leave.MAY):
            yield f"{left.label}: {machine.words!r} in the list {left.leave!r}"
        if (machine.verdict is Verdict.STOP) != (left.leave is Leave.MUST_NOT):
            yield f"{left.label}: verdict {machine.verdict} in the list {left.leave!r}"
        if re.search(r"not judged long enough; not judged long enough", left.reason, re.IGNORECASE):
            yield f"{left.label}: {left.reason!r}"
    named = [t.partition(" – ")[0] for t in document["verdict"]["text"] if " – " in t]
    if double := [name for name, n in Counter(named).items() if n > 1]:
        yield f"{double[0]} stands in two sentences"
    must = [x.label for x in lists if x.leave is Leave.MUST_NOT]
    for text in document["verdict"]["text"]:
        found = re.match(r"Must not go out \((\d+)\): ", text)
        if found and (int(found.group(1)) != len(must) or not all(label in text for label in must[:12])):
            yield f"{text!r}, and {len(must)} in that list"


def _headline(document: FleetDocument) -> Iterator[str]:
    """Numbers of the headline against the lists."""
    counts = Counter(x.leave for x in lists_of(document))
    title = document["verdict"]["title"]
    for leave, form in (
        (Leave.MUST_NOT, r"(\d+)(?: of \d+ machines)? must not go out"),
        (Leave.MAY, r"(\d+)(?: of \d+ machines)? may go out"),
        (Leave.CHECK, r"(\d+) must be checked first"),
    ):
        if (found := re.search(form, title)) and int(found.group(1)) != counts[leave]:
            yield f"{title!r}, and {counts[leave]} in the list {leave!r}"


def _counts(document: FleetDocument) -> Iterator[str]:
    """Missions that judged a part, which are the same for each of its faults."""
    told: dict[tuple[int, str, str], set[int]] = {}
    for f in document["faults"]:
        told.setdefault((f["machine"], f["component"], f["side"]), set()).add(f["assessed"])
    for (machine, component, side), counts in told.items():
        if len(counts) > 1:
            label = document["machines"][machine]["label"]
            yield f"{label}: {component} {side} was judged by {' and by '.join(map(str, sorted(counts)))} missions"


def _table(document: FleetDocument) -> Iterator[str]:
    """``fleet.csv`` against the page: what is unclear there is unclear here."""
    rows = list(csv.DictReader(io.StringIO(fleet_csv(document))))
    for mission, row in zip(document["missions"], rows, strict=True):
        worst = mission["faults"][0] if mission["faults"] else None
        if worst is not None and (row["worst_mode"] == UNCLEAR) != bool(worst.get("unclear")):
            yield f"{mission['name']}: fleet.csv calls its worst fault {row['worst_mode']!r}"


def _words(document: FleetDocument) -> Iterator[str]:
    """One word for one notion, on the page, in the document and in the table."""
    page = re.sub(r"<(script|style).*?</\1>|<[^>]*>", " ", build_fleet_page(document), flags=re.DOTALL)
    baseline = document["baseline"]
    notes = [] if baseline is None else [f["note"] for f in baseline["faults"]]
    for text in (page, *document["verdict"]["text"], *notes):
        if found := re.search(
            r"\bassess\w*|without (control )?signal|too briefly", re.sub(r"[Nn]ot assessed", "", text)
        ):
            yield f"the fleet says {text[max(0, found.start() - 40) : found.end() + 20]!r}"
    if found := re.search(r"([\d.]+ %) +of driving time judged +not known[^.]{,40}", page):
        yield f"a figure that is said to be not known: {found.group(0)!r}"


def _endings(document: FleetDocument) -> Iterator[str]:
    """A fault that lasts to the end of its log, and is told to have been seen last before."""
    page = build_fleet_page(document)
    told = len(re.findall("last seen before its log ended", page))
    places = [
        any(f["id"] == x["last_id"] and f.get("lasting") for f in document["missions"][x["last"]]["faults"])
        for x in document["faults"]
    ]
    if told > places.count(False):
        yield f"{told} faults are said to be last seen before the end of their log, of {places.count(False)}"


def _units(document: FleetDocument) -> Iterator[str]:
    """The unit of the axis of trends: beside the ticks of each picture, and behind each time and distance in words."""
    unit, words = TICK_UNITS[document["axis"]], _UNITS[document["axis"]]
    page = build_fleet_page(document)
    for picture in re.findall(r'<svg class="trend".*?</svg>', page, flags=re.DOTALL):
        ticks = re.findall(r'class="(?:mid|fin)">([^<%]*)<', picture)
        found = {m.group(1) for tick in ticks if (m := re.search(r" ([^\d−]+)$", tick))}
        if found != {unit}:
            yield f"a trend over {words} has ticks in {sorted(found)}"
    for text in (t["forecast"]["words"] for t in document["trends"] if t["forecast"]["state"] != "not_known"):
        for number in re.finditer(r"(?<![\d.])\d[\d.]*(?! to \d)(?![\d.])", text):
            if not text[number.end() :].startswith((*(f" {word}" for word in words), " %")):
                yield f"{number.group(0)} without its unit, {words}: {text!r}"
    for between in re.findall(r"\([\d.]+ ([^)]*) apart\)", page):
        if between not in words:
            yield f"missions {between!r} apart, of a trend over {words}"
    for t, text in zip(_drawn(document), re.findall(r'<b class="fc">.*?</p>', page, flags=re.DOTALL), strict=True):
        if t["first"] > 0 and "the line through all missions" in text:
            yield f"a line from mission {t['first']} on is said to go through all: {text!r}"
    if found_at := re.search(r"[?]\.|\b1 (?:days|missions|hours|points)\b", re.sub(r"<[^>]*>", " ", page)):
        yield f"a slip: {found_at.group(0)!r}"


def _drawn(document: FleetDocument) -> list[TrendRow]:
    """Trends that the page shows, in its order."""
    present: dict[int, list[FleetFaultRow]] = {}
    for f in document["faults"]:
        if f["status"] not in GONE:
            present.setdefault(f["machine"], []).append(f)
    return chosen(document["trends"], lambda t: bool(dead_words(t, present.get(t["machine"], []))))
