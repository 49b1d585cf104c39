"""The paper's table of controllers, as simulated, for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.tables.layout import bullets, section, table, text

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.simulation.controller_table import Band, ControllerRow, ControllerTable

NOTES = (
    "adaptive, finite-time, neural and fuzzy are representatives of the classes that the paper compares with, with as many "
    "parameters; those authors' own code and gains are not public, and these figures say nothing about them",
    "parameters as the paper counts them; the forcing ζ of Ψ̂, which the paper does not have, is not among MFHCA's four",
    "ζ is that of the preset, not tuned; the gains of the others are tuned on one healthy mission",
    "the paper's ranking is not reproduced: healthy, an integrating law leaves less error than Ψ̂ forced by e², which vanishes with e",
    "while a wheel is faulty, the fault decides its error and the law hardly does: look at the last two columns",
)


def controller_parts(found: ControllerTable) -> list[RenderableType]:
    """A table for each scenario, and what has to be known to read them."""
    from diagnosis.decision.metrics import PAPER_TABLE

    printed = {name: (error, effort) for name, error, effort, _ in PAPER_TABLE}
    headings = (
        "controller",
        "class of",
        "error m/s",
        "of seeds",
        "effort",
        "of seeds",
        "parameters",
        "in faults",
        "else",
    )
    parts: list[RenderableType] = []
    for scenario, words in found["scenarios"].items():
        rows = [_cells(row, printed) for row in found["rows"] if row["scenario"] == scenario]
        parts += [section(f"{scenario}: {words}"), table(headings, rows, right=(2, 4, 6, 7, 8))]
    seeds, duration = ", ".join(map(str, found["seeds"])), found["duration_s"]
    parts += [
        "",
        text(
            f"mean |v_a − v_c| over the wheels and mean |u|; seeds {seeds}, {duration:g} s each; in brackets what the paper's table says of that class",
            "dim",
        ),
        bullets(NOTES, "dim"),
    ]
    return parts


def _cells(row: ControllerRow, printed: dict[str, tuple[float, float]]) -> list[str]:
    paper = printed.get(row["stands_for"])
    return [
        row["controller"],
        "reference" if paper is None else f"{row['stands_for']} ({paper[0]:.3f} / {paper[1]:.3f})",
        _mean(row["error"], 4),
        _range(row["error"], 4),
        _mean(row["effort"], 3),
        _range(row["effort"], 3),
        str(row["parameters"]),
        _mean(row["error_in_faults"], 4),
        _mean(row["error_outside"], 4),
    ]


def _mean(band: Band, digits: int) -> str:
    return "–" if band["mean"] is None else f"{band['mean']:.{digits}f}"


def _range(band: Band, digits: int) -> str:
    if band["low"] is None or band["high"] is None or band["low"] == band["high"]:
        return ""
    return f"{band['low']:.{digits}f}–{band['high']:.{digits}f}"
