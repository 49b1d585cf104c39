"""A comparison of two missions on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, cast

from rich.text import Text

from cli.tables.layout import ByWidth, bullets, key_values, section, table, text
from cli.tables.looks import mode_text, severity_text, verdict_style
from diagnosis.comparison.words import CHANGES, OUTCOMES, coverage_words, headline, row_of_found, standing, times
from diagnosis.pages.labels import utc
from diagnosis.results.machine_words import MachineWords, words_of

if TYPE_CHECKING:
    from rich.console import RenderableType

    from diagnosis.comparison.compare import ComparedMission, Comparison, MetricChange
    from diagnosis.comparison.coverage import CoverageChange, SideCoverage
    from diagnosis.comparison.faults import FaultChange
    from diagnosis.comparison.found import FoundFault
    from diagnosis.results.comparison_document import CoverageChangeRow

_STYLES = {"new": "bold red", "worse": "bold red", "resolved": "#2fa98c", "better": "#2fa98c", "unchanged": "dim"}
_SHOWN = 40
_HEADINGS = ("part", "fault", "older", "newer", "changed")
_COLUMNS = {"new": (0, 1, 3), "not_seen_again": (0, 1, 2), "resolved": (0, 1, 2), "unchanged": (0, 1, 2, 3)}


def comparison_parts(found: Comparison) -> list[RenderableType]:
    """Headline, the two missions, faults by what became of them, coverage, figures, and what to bear in mind."""
    words = words_of({"words": found.words})
    several = any(len(f.ids) > 1 for c in found.faults for f in (c.older, c.newer) if f is not None)
    label, style = _label(found)
    parts: list[RenderableType] = [
        Text.assemble((f" {label} ", style), "  ", text(headline(found.counts, several=several), "bold")),
        "",
        key_values([("older", _mission(found.older)), ("newer", _mission(found.newer))]),
    ]
    parts += _faults(found.faults, words)
    parts += [section("Judged long enough, and cleared"), *_coverage(found.coverage, words)]
    if found.metrics:
        parts += [section("While driving"), _metrics(found.metrics, words)]
    if found.notes:
        parts += [section("Notes"), bullets(found.notes)]
    return [*parts, ""]


def _label(found: Comparison) -> tuple[str, str]:
    """Word and style of the outcome; what is no worse is no relief while a fault stands."""
    if found.worse:
        return "WORSE", "bold white on #b63a00"
    if standing(found.counts):
        return "NOT WORSE, FAULTS STAND", "bold black on #f2b11b"
    return "NOT WORSE", "bold white on #1d7a63"


def _mission(m: ComparedMission) -> Text:
    label = m.verdict.short.upper()
    when = f"{utc(m.start_ns)} UTC, {m.duration_s:.0f} s, {m.driving_s:.0f} s driving"
    title = "" if m.title.upper() == label else m.title
    return Text.assemble(
        text(m.name), "  ", text(when, "dim"), "\n", text(label, f"bold {verdict_style(m.verdict)}"), "  ", text(title)
    )


def _part(c: FaultChange, words: MachineWords) -> str:
    return words.part_words(c.kind, c.component, c.side)


def _faults(faults: Sequence[FaultChange], machine_words: MachineWords) -> list[RenderableType]:
    """A table per outcome, their columns in line; what limits a statement stands beneath it."""
    width = max((len(_part(c, machine_words)) for c in faults), default=0)
    parts: list[RenderableType] = []
    for outcome, words in OUTCOMES.items():
        mine = [c for c in faults if (c.trend or c.status) == outcome]
        if not mine:
            continue
        style = _STYLES.get(outcome, "bold")
        parts += ["", text(f"{words[0].upper()}{words[1:]} ({len(mine)})", style)]
        shown = mine[:_SHOWN]
        kept = _COLUMNS.get(outcome, range(5))
        wide, narrow = (
            table(
                [_HEADINGS[i] for i in kept],
                [
                    [(_part(c, machine_words).ljust(width), _rows(c), *_both(c, bounds), _changed(c))[i] for i in kept]
                    for c in shown
                ],
            )
            for bounds in (True, False)
        )
        parts.append(ByWidth(wide, narrow, 110))
        if len(mine) > _SHOWN:
            parts.append(text(f"… and {len(mine) - _SHOWN} more (--json, -o FILE.html)", "dim"))
        alike: dict[str, list[str]] = {}
        for c in shown:
            if c.note:
                alike.setdefault(c.note, []).append(_part(c, machine_words))
        notes = [f"{', '.join(dict.fromkeys(named))}: {note}" for note, named in alike.items()]
        if notes:
            parts.append(bullets(notes, "dim"))
    return parts


def _rows(c: FaultChange) -> Text:
    words = dict.fromkeys(row_of_found(f.mode, f.side, f.rows) for f in (c.older, c.newer) if f is not None)
    return Text(" → ").join(mode_text(mode, label[0].lower() + label[1:]) for mode, label in words)


def _both(c: FaultChange, bounds: bool) -> tuple[Text, Text]:
    return _found(c.older, bounds), _found(c.newer, bounds)


def _found(f: FoundFault | None, bounds: bool) -> Text:
    """Severity, number and time of the faults, their probability, and ε̂ where the row leaves it open."""
    if f is None:
        return text("–")
    words = f" {times(len(f.ids), f.seconds)}, p {f.probability:.2f}"
    if f.epsilon is not None and not f.mode.total:
        words += f", ε {f.epsilon['value']:.2f}"
        words += f" ({f.epsilon['low']:.2f}–{f.epsilon['high']:.2f})" if bounds else ""
    return Text.assemble(severity_text(f.severity), text(words))


def _changed(c: FaultChange) -> str:
    return ", ".join(CHANGES[name] for name in c.changes)


def _coverage(changes: Sequence[CoverageChange], words: MachineWords) -> list[RenderableType]:
    differing = [c for c in changes if c.change]
    neither = [
        words.part_words(c.kind, c.component, c.side) for c in changes if not c.change and not _assessed(c.newer)
    ]
    parts: list[RenderableType] = []
    if differing:
        rows = [
            (
                words.part_words(c.kind, c.component, c.side),
                text(
                    coverage_words(cast("CoverageChangeRow", asdict(c))),
                    "bold red" if c.change == "lost" else "#2fa98c",
                ),
                _judged(c.older),
                _judged(c.newer),
            )
            for c in differing
        ]
        parts.append(table(("part", "", "driving judged, older", "newer"), rows))
    else:
        parts.append(text("The same parts in both missions."))
    if neither:
        parts.append(text(f"In neither mission: {', '.join(neither)}.", "dim"))
    return parts


def _assessed(side: SideCoverage | None) -> bool:
    return side is not None and side.assessed


def _judged(side: SideCoverage | None) -> str:
    if side is None:
        return "not in the result"
    return "no evidence" if side.tier == "none" else f"{side.decided_s:.1f} of {side.driving_s:.1f} s ({side.tier})"


def _metrics(rows: Sequence[MetricChange], words: MachineWords) -> RenderableType:
    cells: list[tuple[str, ...]] = [
        (
            r.wheel,
            *_pair(r.tracking_error_older, r.tracking_error_newer),
            *_pair(_percent(r.control_effort_older), _percent(r.control_effort_newer), 1),
        )
        for r in rows
    ]
    headings: tuple[str, ...] = (
        "",
        f"error, older [{words.speed_unit}]",
        "newer",
        "",
        f"effort, older [{words.percent.strip()}]",
        "newer",
        "",
    )
    if not any(r.control_effort_older is not None or r.control_effort_newer is not None for r in rows):
        cells, headings = [row[:4] for row in cells], headings[:4]  # no command of a drive is logged
    return table(headings, cells, right=range(1, len(headings)))


def _percent(share: float | None) -> float | None:
    return None if share is None else 100 * share


def _pair(a: float | None, b: float | None, digits: int = 3) -> tuple[str, str, str]:
    change = f"{round(100 * (b / a - 1)):+d} %" if a and b is not None else ""
    return _number(a, digits), _number(b, digits), change


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
