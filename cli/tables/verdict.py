"""A diagnosed mission in a few lines of the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from cli.tables.layout import MODE_SIGNS, MODE_STYLES, SEVERITY_STYLES, bullets, section, table, text
from diagnosis.comparison.words import OUTCOMES, headline
from diagnosis.report.confidence import headline as verdict_words
from diagnosis.report.confidence import sure_of
from diagnosis.report.tables import merged_caveats
from diagnosis.results.document import ActionRow, ReportDocument
from diagnosis.results.fault_rows import mode_words, state_label
from diagnosis.results.vocabulary import part_words

_STYLES = {
    "ready": "bold white on #1d7a63",
    "watch": "bold black on #f2b11b",
    "stop": "bold white on #b63a00",
    "not_assessed": "bold reverse",
}
_SHOWN, _ENDLESS = 40, 10_000
_WORDS, _SATURATION = (1, 2), 5  # columns of words, which may wrap between them, and the one that is needed least


def verdict_parts(report: ReportDocument) -> list[RenderableType]:
    """Verdict, what to do, faults and caveats of a report document."""
    verdict = report["verdict"]
    label, answer = verdict_words(report)
    title = str(verdict.get("title", ""))
    first = Text.assemble((f" {label.upper()} ", _STYLES.get(verdict["status"], "bold")))
    if answer:
        first.append_text(text(f"– {answer}", "bold"))
    parts: list[RenderableType] = [first]
    if title.casefold() != label.casefold():
        parts.append(text(title, "bold"))
    if verdict.get("text") and verdict["text"] != title:
        parts.append(text(verdict["text"]))
    if verdict.get("actions"):
        parts += [section("What to do"), _actions(verdict["actions"], report)]
    if report["intervals"]:
        parts += [section("Faults"), _faults(report["intervals"])]
        rest = len(report["intervals"]) - _SHOWN
        if rest > 0:
            parts.append(text(f"… and {rest} more in the report", "dim"))
    if report.get("previous"):
        parts += [section("Against another mission of the machine"), *_previous(report["previous"])]
    if verdict.get("caveats"):
        parts += [section("To bear in mind"), bullets(merged_caveats(verdict["caveats"]))]
    return [*parts, ""]


def _previous(found: Mapping[str, Any]) -> list[RenderableType]:
    """How many faults became what, and the new and worse ones."""
    mission = found["mission"]
    which = "later" if found["order"] == "later" else "previous"
    logs = " + ".join(mission.get("files") or ()) or "no log named"
    parts: list[RenderableType] = [text(f"{headline(found['counts'])} ({which} mission: {logs})")]
    told = [c for c in found["faults"] if (c["trend"] or c["status"]) in ("new", "worse", "resolved", "not_seen_again")]
    parts += [bullets([_became(c) for c in told[:_SHOWN]])] if told else []
    return parts


def _became(c: Mapping[str, Any]) -> str:
    words = OUTCOMES[c["trend"] or c["status"]]
    return f"{words}: {part_words(c['kind'], c['component'], c['side'])} {mode_words(c['side'], c['mode'])}"


def _actions(actions: list[ActionRow], report: ReportDocument) -> Table:
    """Each action with its faults, and how sure the tool is of the worst of them."""
    intervals = {i["id"]: i for i in report["intervals"]}
    out = Table.grid(padding=(0, 2, 0, 0))
    for action in actions:
        style = SEVERITY_STYLES.get(str(action.get("severity")), "")
        faults = ", ".join(str(f) for f in action.get("faults", ())[:6])
        more = "" if len(action.get("faults", ())) <= 6 else ", …"
        out.add_row(text(action.get("n", ""), style), Text.assemble(text(action["text"]), "  ", (faults + more, "dim")))
        worst = next((intervals[f] for f in action.get("faults", ()) if f in intervals), None)
        if worst is not None and (sure := sure_of(worst, report)):
            out.add_row("", text(f"{sure}.", "dim"))
    return out


class _Fitting:
    """The first of some tables that fits on the terminal, else the last."""

    def __init__(self, tables: list[Table]) -> None:
        self._tables = tables

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        wide = options.update(width=_ENDLESS)
        fitting = (t for t in self._tables if Measurement.get(console, wide, t).maximum <= options.max_width)
        yield next(fitting, self._tables[-1])


def _faults(intervals: Sequence[Mapping[str, Any]]) -> _Fitting:
    """Table of faults; on a narrow terminal without the saturation, on a narrower one without the bounds of ε."""
    heads = ("", "part", "fault", "time [s]", "ε", "saturation", "p", "severity")
    forms = []
    for left_out, bounds in (((), True), ((_SATURATION,), True), ((_SATURATION,), False)):
        keep = [k for k in range(len(heads)) if k not in left_out]
        rows = [_fault(i, bounds) for i in intervals[:_SHOWN]]
        form = table(
            [heads[k] for k in keep],
            [[row[k] for k in keep] for row in rows],
            right=[keep.index(k) for k in (3, 6)],
        )
        for k, column in zip(keep, form.columns, strict=True):
            column.no_wrap = k not in _WORDS
        forms.append(form)
    return _Fitting(forms)


def _fault(fault: Mapping[str, Any], bounds: bool) -> tuple[object, ...]:
    mode, severity = str(fault["mode"]), str(fault["severity"])
    digits = 2 if fault["stop_s"] - fault["start_s"] >= 0.1 else 3
    return (
        text(fault["id"], "dim"),
        f"{fault['component']} {str(fault['side']).replace('_', ' ')}",
        text(f"{MODE_SIGNS.get(mode, '·')} {state_label(mode, str(fault['side'])).lower()}", MODE_STYLES.get(mode, "")),
        f"{fault['start_s']:.{digits}f}–{fault['stop_s']:.{digits}f}",
        _epsilon(fault.get("epsilon"), bounds),
        _sat(fault.get("sat")),
        f"{fault['probability']:.3f}",
        text(severity, SEVERITY_STYLES.get(severity, "")),
    )


def _epsilon(value: Mapping[str, Any] | None, bounds: bool) -> str:
    if not value or value.get("value") is None:
        return "–"
    low, high = value.get("low"), value.get("high")
    known = bounds and low is not None and high is not None
    return f"{value['value']:.2f}" + (f" ({low:.2f}–{high:.2f})" if known else "")


def _sat(value: Mapping[str, Any] | None) -> str:
    if not value or value.get("mean") is None:
        return "–"
    unit = str(value.get("unit", ""))
    mean = f"{value['mean']:+.3f}"
    return ("0" if float(mean) == 0 else mean) + (f" {unit}" if unit in ("m/s", "rad") else "")
