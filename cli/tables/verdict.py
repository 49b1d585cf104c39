"""A diagnosed mission in a few lines of the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table

from cli.tables.layout import Sentence, bullets, paragraph, section, table, text
from cli.tables.logs import log_parts
from cli.tables.looks import mode_text, severity_text, verdict_title
from diagnosis.comparison.words import OUTCOMES, are_several, headline
from diagnosis.report.confidence import headline as verdict_words
from diagnosis.report.confidence import sure_of_action
from diagnosis.report.tables import clearing_sentences, merged_caveats, other_caveats
from diagnosis.results.candidates import label_of, symbol_of
from diagnosis.results.comparison_document import FaultChangeRow, PreviousRow
from diagnosis.results.document import PAPER_DEFAULTS, ActionRow, IntervalRow, MachineRow, ReportDocument
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.size_rows import EpsilonRow, SatRow
from diagnosis.results.vocabulary import Severity
from replay.machine.quantities import OPENING

_SHOWN, _FAULTS_NAMED, _ENDLESS = 40, 6, 10_000
_OFTEN = 3  # spells of one part that are called the same, and stand on one line
_WORDS, _SATURATION = (1, 2), 5  # columns of words, which may wrap between them, and the one that is needed least


def verdict_parts(report: ReportDocument) -> list[RenderableType]:
    """Verdict, what to do, faults and caveats of a report document."""
    verdict = report["verdict"]
    label, answer = verdict_words(report)
    words = words_of(report["machine"])
    title = verdict["title"]
    first = verdict_title(verdict["status"], label)
    if answer:
        first.append_text(text(f"– {answer}", "bold"))
    parts: list[RenderableType] = [first]
    if title.casefold() != label.casefold():
        parts.append(paragraph(title, "bold"))
    if verdict["text"] and verdict["text"] != title:
        parts.append(paragraph(verdict["text"]))
    parts += _assumed(report["machine"])
    if verdict["actions"]:
        parts += [section("What to do"), _actions(verdict["actions"], report)]
    if report["intervals"]:
        remarks = sum(f["severity"] == Severity.INFO for f in report["intervals"])
        also = f", and {remarks} remark{'s' * (remarks > 1)} (severity info)" if remarks else ""
        parts += [section(f"Faults{also}"), _faults(report["intervals"], words)]
        rest = len(_lines(report["intervals"], None)) - _SHOWN
        if rest > 0:
            parts.append(text(f"… and {rest} more in the report", "dim"))
    if "previous" in report:
        parts += [section("Compared with another mission of the machine"), *_previous(report["previous"], words)]
    if rows := clearing_sentences(verdict):
        told = [f"{reason} To clear it: {act}." if act else reason for reason, act in rows]
        parts += [section("What is open, and what would clear it"), bullets(told)]
    if caveats := other_caveats(verdict):
        parts += [section("Limits of this verdict"), bullets(merged_caveats(caveats))]
    return [*parts, *log_parts(report), ""]


def _assumed(machine: MachineRow) -> list[RenderableType]:
    """Numbers of the paper's machine that stand in for this one's, behind the verdict that rests on them."""
    if not machine["assumed"]:
        return []
    given = machine["source"] != PAPER_DEFAULTS
    what = f"{machine['source']} leaves out some numbers" if given else "No machine file was given"
    do = (
        f"Add them to {machine['source']}."
        if given
        else "`mfhca config init --log LOG -o machine.toml` writes a machine file from the log."
    )
    return [
        "",
        paragraph(f"{what}: the paper's Haulotte 16RTJ PRO stands in.", "bold yellow"),
        paragraph(f"Of that machine, not known to be of this one: {'; '.join(machine['assumed'])}. {do}"),
    ]


def _previous(found: PreviousRow, words: MachineWords) -> list[RenderableType]:
    """How many faults became what, and the new and worse ones."""
    mission = found["mission"]
    which = "later" if found["order"] == "later" else "previous"
    logs = " + ".join(mission["files"]) or "no log named"
    parts: list[RenderableType] = [
        text(f"{headline(found['counts'], several=are_several(found['faults']))} ({which} mission: {logs})")
    ]
    worth_saying = ("new", "worse", "resolved", "not_seen_again")
    named = [c for c in found["faults"] if (c["trend"] or c["status"]) in worth_saying]
    parts += [bullets([_became(c, words) for c in named[:_SHOWN]])] if named else []
    return parts


def _became(c: FaultChangeRow, words: MachineWords) -> str:
    outcome = OUTCOMES[c["trend"] or c["status"]]
    return f"{outcome}: {words.part_words(c['kind'], c['component'], c['side'])} {mode_words(c['side'], c['mode'])}"


def _actions(actions: Sequence[ActionRow], report: ReportDocument) -> Table:
    """Each action with its faults, and how sure the tool is of the worst of them."""
    intervals = {i["id"]: i for i in report["intervals"]}
    out = Table.grid(padding=(0, 2, 0, 0))
    said: dict[str, int] = {}
    for action in actions:
        lead = action.get("lead", "")
        rest = len(action["faults"]) - _FAULTS_NAMED
        faults = ", ".join(action["faults"][: _FAULTS_NAMED if rest > 1 else None])
        more = f" and {rest} more" if rest > 1 else ""
        out.add_row(
            severity_text(action["severity"], action["n"]),
            Sentence.assemble(
                text(lead, "bold"), text(action["text"].removeprefix(lead)), "  ", (faults + more, "dim")
            ),
        )
        own = [intervals[f] for f in action["faults"] if f in intervals]
        if own and (sure := sure_of_action(own, report)):
            out.add_row("", text(f"{sure}.", "dim"))
        if check := action.get("check"):
            same = said.setdefault(check, action["n"])
            how = check if same == action["n"] else f"as for {same}."
            out.add_row("", Sentence.assemble(text("How to check: ", "bold"), text(how)))
    return out


class _Fitting:
    """The first of some tables that fits on the terminal, else the last."""

    def __init__(self, tables: list[Table]) -> None:
        self._tables = tables

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        wide = options.update(width=_ENDLESS)
        fitting = (t for t in self._tables if Measurement.get(console, wide, t).maximum <= options.max_width)
        yield next(fitting, self._tables[-1])


def _faults(intervals: Sequence[IntervalRow], words: MachineWords) -> _Fitting:
    """Table of faults; on a narrow terminal without the saturation, on a narrower one without the bounds of ε."""
    heads = ("", "part", "fault", "time [s]", "ε", "saturation", "P(kind)", "severity")
    forms = []
    for left_out, bounds in (((), True), ((_SATURATION,), True), ((_SATURATION,), False)):
        keep = [k for k in range(len(heads)) if k not in left_out]
        rows = [
            _spells(same, words, bounds) if len(same) > 1 else _fault(same[0], words, bounds)
            for same in _lines(intervals)
        ]
        form = table(
            [heads[k] for k in keep],
            [[row[k] for k in keep] for row in rows],
            right=[keep.index(k) for k in (3, 6)],
        )
        for k, column in zip(keep, form.columns, strict=True):
            column.no_wrap = k not in _WORDS
        forms.append(form)
    return _Fitting(forms)


def _lines(intervals: Sequence[IntervalRow], most: int | None = _SHOWN) -> list[list[IntervalRow]]:
    """Faults by the lines of the table: each by itself, but for those of one part that are called the same and come again and again."""
    kinds: dict[tuple[str, ...], list[IntervalRow]] = {}
    for i in intervals:
        kinds.setdefault((i["component"], i["side"], label_of(i), i["severity"]), []).append(i)
    often = {id(i): same for same in kinds.values() if len(same) >= _OFTEN for i in same}
    out = [often.get(id(i), [i]) for i in intervals if id(i) not in often or often[id(i)][0] is i]
    return out[:most]


def _spells(same: Sequence[IntervalRow], words: MachineWords, bounds: bool) -> tuple[object, ...]:
    """One line for a fault that comes again and again: from when to when, and between which values its spells lie."""
    best = same[0]
    _, part, _, _, *_ = _fault(best, words, bounds)
    sats = {_sat(i["sat"], words) for i in same}
    rest = (
        _between([i["epsilon"]["value"] for i in same if i["epsilon"] is not None], 2),
        sats.pop() if len(sats) == 1 else "differs",
        _between([i["probability"] for i in same], 3),
        severity_text(best["severity"]),
    )
    first, last = min(i["start_s"] for i in same), max(i["stop_s"] for i in same)
    name = text(f"{same[0]['id']} …", "dim")
    return (
        name,
        part,
        mode_text(symbol_of(best), f"{label_of(best).lower()}, {len(same)} times"),
        f"{first:.2f}–{last:.2f}",
        *rest,
    )


def _between(values: Sequence[float], digits: int) -> str:
    """One value, or the least and the largest of several; a dash where there is none."""
    if not values:
        return "–"
    said = dict.fromkeys(f"{x:.{digits}f}" for x in (min(values), max(values)))
    return " to ".join(said).replace("-", "−")


def _fault(fault: IntervalRow, words: MachineWords, bounds: bool) -> tuple[object, ...]:
    digits = 2 if fault["stop_s"] - fault["start_s"] >= 0.1 else 3
    return (
        text(fault["id"], "dim"),
        words.part_words(fault["kind"], fault["component"], fault["side"]),
        mode_text(symbol_of(fault), label_of(fault).lower()),
        f"{fault['start_s']:.{digits}f}–{fault['stop_s']:.{digits}f}",
        _epsilon(fault["epsilon"], bounds),
        _sat(fault["sat"], words),
        f"{fault['probability']:.3f}",
        severity_text(fault["severity"]),
    )


def _epsilon(epsilon: EpsilonRow | None, bounds: bool) -> str:
    if epsilon is None:
        return "–"
    to = " to " if epsilon["low"] < 0 else "–"
    said = f"{epsilon['value']:.2f}" + (f" ({epsilon['low']:.2f}{to}{epsilon['high']:.2f})" if bounds else "")
    return said.replace("-", "−")


def _sat(sat: SatRow | None, words: MachineWords) -> str:
    if sat is None:
        return "–"
    if sat["unit"] == OPENING:
        share = f"{100 * sat['mean']:+.1f}"
        return ("0" if float(share) == 0 else share.replace("-", "−")) + words.percent
    mean, unit = f"{sat['mean']:+.3f}", sat["unit"]
    return ("0" if float(mean) == 0 else mean.replace("-", "−")) + (f" {unit}" if unit else "")
