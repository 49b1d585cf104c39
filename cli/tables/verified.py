"""`mfhca diagnose --verify`: each fault beside what filterpy makes of its readings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import RenderableType

from cli.tables.layout import table, text

if TYPE_CHECKING:
    from diagnosis.decision.verified import Verified
    from diagnosis.results.document import ReportDocument
    from diagnosis.results.size_rows import EpsilonRow


def verified_parts(report: ReportDocument, found: Sequence[Verified]) -> list[RenderableType]:
    """Heading, table, and what it says."""
    if not found:
        return [text("Verified by filterpy: no fault of at least low severity")]
    from diagnosis.results.fault_rows import state_label

    by_id = {f["id"]: f for f in report["intervals"]}
    rows, agree, compared = [], 0, 0
    for one in found:
        fault = by_id[one.id]
        part = f"{fault['component']} {fault['side'].replace('_', ' ')}"
        if one.why:
            rows.append((one.id, part, state_label(fault["mode"], fault["side"]), "–", "", "", "", one.why))
            continue
        if one.row is not None:
            compared += 1
            agree += str(one.row) == str(fault["mode"])
        rows.append(
            (
                one.id,
                part,
                state_label(fault["mode"], fault["side"]),
                "departs from the expected speed" if one.row is None else state_label(one.row, fault["side"]),
                "beyond 10^100" if one.gain > 230.0 else f"10^{one.gain / 2.302585:.0f}",
                _share(fault["epsilon"]),
                "" if one.epsilon is None else _share(one.epsilon.row()),
                f"{one.readings} readings",
            )
        )
    headings = ("", "part", "reported", "filterpy", "odds of a fault", "ε̂ reported", "ε̂ filterpy", "")
    return [
        text("Verified by filterpy, stepped reading by reading", "bold"),
        table(headings, rows, right=(4, 5, 6)),
        text(f"The same row in {agree} of {compared} faults whose readings tell rows apart."),
    ]


def _share(epsilon: EpsilonRow | None) -> str:
    return "" if epsilon is None else f"{epsilon['value']:.2f} ({epsilon['low']:.2f}–{epsilon['high']:.2f})"
