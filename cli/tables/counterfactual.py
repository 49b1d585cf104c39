"""A mission under other laws, for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.tables.layout import bullets, key_values, section, table, text

if TYPE_CHECKING:
    from rich.console import RenderableType

    from diagnosis.counterfactual.document import BandRow, CounterfactualDocument, LawRow

_HEADINGS = ("law", "error m/s", "90 %", "healthy", "faulty", "effort", "90 %", "back s", "wear /s", "full", "par.")


def counterfactual_parts(document: CounterfactualDocument) -> list[RenderableType]:
    """Self-replay, a row per law, and what was left out."""
    own = document["self_replay"]
    error = f"mean |e| {own['error_recorded']:.4f} → {own['error_replayed']:.4f} m/s"
    effort = f"effort {own['effort_recorded']:.4f} → {own['effort_replayed']:.4f}"
    gains = ", ".join(f"{k} {v:.4g}" for k, v in own["gains"].items())
    plant = ", ".join(f"{p['wheel']} {p['K']:.3g} m/s / {p['tau']:.2g} s" for p in document["plant"])
    rows = [
        (
            "mission",
            f"{', '.join(document['log'])}: {document['duration_s']:.1f} s at {document['rate_hz']:g} Hz, {document['faults']} faults of wheels",
        ),
        ("law that ran", f"{own['law']}: {gains}"),
        ("self-replay", f"{error}, {effort}; wheels {1e3 * own['shift']:.2g} mm/s apart on average"),
        ("plant K / τ", plant),
    ]
    laws = [_cells(row) for row in (document["recorded"], *document["laws"])]
    parts: list[RenderableType] = [
        key_values(rows),
        section("The same mission under other laws"),
        table(_HEADINGS, laws, right=tuple(range(1, len(_HEADINGS)))),
        "",
        text(_legend(document), "dim"),
    ]
    if document["notes"]:
        parts += [section("Left out and assumed"), bullets(document["notes"])]
    return parts


def _legend(document: CounterfactualDocument) -> str:
    draws = f"90 %: of {document['draws']} draws of K, τ and ε̂; " if document["draws"] else "no bands were asked for; "
    return (
        "error: mean |v − v_c| where the wheel's speed is known; effort: mean |u|; "
        + draws
        + "back: median time from a fault's end until the wheel follows again; wear: Σ|Δu| per second; full: share of commands at their limit; "
        "par.: parameters as the paper counts them"
    )


def _cells(row: LawRow) -> list[str]:
    figures = row["figures"]
    error, effort = figures["tracking_error"], figures["control_effort"]
    times = sorted(r["recovery_s"] for r in row["recoveries"] if r["recovery_s"] is not None)
    return [
        row["law"] + (" (tuned)" if row["tuned"] else ""),
        _number(error["mission"], 4),
        _band(row["error_band"], 4),
        _number(error["healthy"], 4),
        _number(error["faulty"], 4),
        _number(effort["mission"], 3),
        _band(row["effort_band"], 3),
        _number(times[len(times) // 2] if times else None, 2),
        _number(figures["total_variation"], 1),
        f"{100 * figures['saturated']:.1f} %",
        str(row["parameters"]),
    ]


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _band(band: BandRow | None, digits: int) -> str:
    return "" if band is None else f"{band['low']:.{digits}f}–{band['high']:.{digits}f}"
