"""A diagnosed mission in a few lines of the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from cli.tables import MODE_SIGNS, MODE_STYLES, SEVERITY_STYLES, bullets, section, table, text

_STATUS = {
    "ready": ("READY", "bold white on #1d7a63"),
    "watch": ("WATCH", "bold black on #f2b11b"),
    "stop": ("STOP AND REPAIR", "bold white on #b63a00"),
    "not_assessed": ("NOT ASSESSED", "bold reverse"),
}
_SHOWN = 40


def verdict_parts(report: Mapping[str, Any]) -> list[RenderableType]:
    """Verdict, what to do, faults and caveats of a report document."""
    verdict = report["verdict"]
    label, style = _STATUS.get(verdict["status"], (str(verdict["status"]), "bold"))
    title = str(verdict.get("title", ""))
    parts: list[RenderableType] = [Text.assemble((f" {label} ", style), "  ", text(title, "bold"))]
    if verdict.get("text") and verdict["text"] != title:
        parts.append(text(verdict["text"]))
    if verdict.get("actions"):
        parts += [section("What to do"), _actions(verdict["actions"])]
    if report["intervals"]:
        parts += [section("Faults"), _faults(report["intervals"])]
        rest = len(report["intervals"]) - _SHOWN
        if rest > 0:
            parts.append(text(f"… and {rest} more in the report", "dim"))
    if verdict.get("caveats"):
        parts += [section("To bear in mind"), bullets(verdict["caveats"])]
    return [*parts, ""]


def _actions(actions: list[Mapping[str, Any]]) -> Table:
    out = Table.grid(padding=(0, 2, 0, 0))
    for action in actions:
        style = SEVERITY_STYLES.get(str(action.get("severity")), "")
        faults = ", ".join(str(f) for f in action.get("faults", ())[:6])
        more = "" if len(action.get("faults", ())) <= 6 else ", …"
        out.add_row(text(action.get("n", ""), style), Text.assemble(text(action["text"]), "  ", (faults + more, "dim")))
    return out


def _faults(intervals: list[Mapping[str, Any]]) -> Table:
    rows = [
        (
            text(i["id"], "dim"),
            f"{i['component']} {str(i['side']).replace('_', ' ')}",
            text(
                f"{MODE_SIGNS.get(i['mode'], '·')} {str(i['mode']).replace('_', ' ')}", MODE_STYLES.get(i["mode"], "")
            ),
            f"{i['start_s']:.3f}–{i['stop_s']:.3f}",
            _epsilon(i.get("epsilon")),
            _sat(i.get("sat")),
            f"{i['probability']:.3f}",
            text(i["severity"], SEVERITY_STYLES.get(i["severity"], "")),
        )
        for i in intervals[:_SHOWN]
    ]
    return table(("", "part", "fault", "time [s]", "ε", "saturation", "p", "severity"), rows, right=(3, 6))


def _epsilon(value: Mapping[str, Any] | None) -> str:
    if not value or value.get("value") is None:
        return "–"
    low, high = value.get("low"), value.get("high")
    bounds = f" ({low:.2f}–{high:.2f})" if low is not None and high is not None else ""
    return f"{value['value']:.2f}{bounds}"


def _sat(value: Mapping[str, Any] | None) -> str:
    if not value or value.get("mean") is None:
        return "–"
    unit = str(value.get("unit", ""))
    mean = f"{value['mean']:+.3f}"
    return ("0" if float(mean) == 0 else mean) + (f" {unit}" if unit in ("m/s", "rad") else "")
