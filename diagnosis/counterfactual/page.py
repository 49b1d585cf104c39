"""The page of a counterfactual: one HTML file that works offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import jinja2
import numpy as np
import orjson
from markupsafe import Markup
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted
from diagnosis.counterfactual.document import BandRow, CounterfactualDocument, LawRow, ProofRow
from diagnosis.counterfactual.plots import MOST_FAULTS, page_plots
from diagnosis.pages import labels
from diagnosis.pages.environment import SHARED, asset, environment, shared_style
from diagnosis.pages.scripts import packed, packed_plotly, script_policy
from diagnosis.results.fault_rows import state_label

#: What a template is filled with.
Context = dict[str, object]

_HERE = Path(__file__).parent
_METHOD = (
    "Abduct: loads on each wheel, faults (δ = 1 − ε̂ of each side) and the plant come from the recording and its diagnosis. Act: another "
    "law answers. Predict: both worlds run side by side; loads, noise and ground are the same in both and cancel in their difference Δv.",
    "τ Δv' = −Δv + [p(u*) − p(u)] − [f(s*) − f(s)], with the valves' maps and the pump's share p, and the tyres' forces f against a body "
    "that all wheels share. A faulty valve lets δ_a of a change of command through, a faulty sensor δ_s of a change of speed.",
    "Self-replay: the law found in the recording must give the recorded mean |e| within 2 % and effort within 5 %, else nothing is predicted.",
    "Error: mean |v − v_c| over wheels, with the second speed sensor where there is one. Where a faulty sensor hides the speed and there is "
    "no second one, the time is left out.",
    "The machine is taken to meet the same ground at the same time. Under a law with which it lags far behind it would have been elsewhere; "
    "on ice that shows.",
    "adaptive, finite-time, neural and fuzzy are representatives of the classes that the paper compares with; those authors' own code and "
    "gains are not public, and nothing here says anything about them.",
)


def build_counterfactual_page(
    document: CounterfactualDocument,
    columns: Mapping[str, NDArray[np.float64]],
    abducted: Abducted,
    wheels: Sequence[str],
) -> str:
    """Page of a counterfactual; the same input gives the same text.

    Columns of shape (n,), SI.

    Parameters
    ----------
    document : CounterfactualDocument
        From `diagnosis.counterfactual.run.counterfactual`.
    columns : Mapping[str, NDArray[np.float64]]
        From `diagnosis.counterfactual.columns.world_columns`.
    abducted : Abducted
        The recorded mission.
    wheels : Sequence[str]
        Its wheels.
    """
    document = labels.made_visible(document)
    names = [row["law"] for row in document["laws"]]
    source, plotly, version = packed_plotly()
    head, script = asset(SHARED / "theme.js"), asset(_HERE / "counterfactual.js")
    plots = page_plots(columns, abducted, wheels, names)
    rows = [document["recorded"], *document["laws"]]
    worst = max(_most(row) for row in rows)
    own = document["self_replay"]
    context: Context = {
        "title": f"{', '.join(document['log'])} under other laws",
        "log": ", ".join(document["log"]),
        "machine": document["machine"],
        "css": Markup(shared_style() + asset(_HERE / "counterfactual.css")),
        "csp": script_policy([head, script, source]),
        "head": Markup(head),
        "script": Markup(script),
        "plotly": plotly,
        "plotly_version": version,
        "data": packed(orjson.dumps(plots)),
        "views": [v["label"] for v in plots["views"]],
        "unlisted": max(0, document["faults"] - MOST_FAULTS),
        "facts": _facts(document),
        "own": own,
        "gains": _gains(own["gains"]),
        "laws": [_law(row, worst) for row in rows],
        "recoveries": _recoveries(rows),
        "law_names": [row["law"] for row in rows],
        "proof": [_proof(row) for row in document["proof"]],
        "plant": document["plant"],
        "plant_note": document["plant_note"],
        "draws": document["draws"],
        "notes": document["notes"],
        "readings": document["readings"],
        "method": _METHOD,
    }
    return _environment().get_template("counterfactual.html.j2").render(context)


@lru_cache
def _environment() -> jinja2.Environment:
    return environment(_HERE)


def _facts(document: CounterfactualDocument) -> list[tuple[str, str]]:
    known = min(document["known_s"].values(), default=0.0)
    return [
        ("Mission", f"{labels.span(document['duration_s'])} at {document['rate_hz']:g} Hz"),
        ("Faults of wheels", str(document["faults"])),
        ("Speed known, of each wheel at least", labels.span(known)),
        ("Bands", f"90 % of {document['draws']} draws of K, τ and ε̂" if document["draws"] else "none asked for"),
    ]


def _gains(gains: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.4g}" for name, value in gains.items())


def _most(row: LawRow) -> float:
    error = row["figures"]["tracking_error"]
    return max(x or 0.0 for x in (error["healthy"], error["faulty"], 1e-9))


def _law(row: LawRow, worst: float) -> Context:
    figures = row["figures"]
    error, effort = figures["tracking_error"], figures["control_effort"]
    times = sorted(r["recovery_s"] for r in row["recoveries"] if r["recovery_s"] is not None)
    back = f"{times[len(times) // 2]:.2f} s ({len(times)} of {len(row['recoveries'])})" if times else "–"
    return {
        "name": row["law"],
        "title": row["title"] + (", tuned" if row["tuned"] else ""),
        "error": _number(error["mission"], 4),
        "error_band": _band(row["error_band"], 4),
        "healthy": _number(error["healthy"], 4),
        "faulty": _number(error["faulty"], 4),
        "healthy_bar": 100 * (error["healthy"] or 0.0) / worst,
        "faulty_bar": 100 * (error["faulty"] or 0.0) / worst,
        "effort": _number(effort["mission"], 3),
        "effort_band": _band(row["effort_band"], 3),
        "effort_healthy": _number(effort["healthy"], 3),
        "effort_faulty": _number(effort["faulty"], 3),
        "recovery": back,
        "variation": f"{figures['total_variation']:.2f}",
        "saturated": f"{100 * figures['saturated']:.1f} %",
        "parameters": row["parameters"],
        "gains": _gains(row["gains"]),
    }


def _recoveries(rows: Sequence[LawRow]) -> list[Context]:
    found: list[Context] = []
    for parts in zip(*(row["recoveries"] for row in rows), strict=True):
        first = parts[0]
        cells = ["–" if p["recovery_s"] is None else f"{p['recovery_s']:.2f}" for p in parts]
        found.append(
            {
                "part": f"{first['component']} {first['side']}",
                "row": state_label(first["mode"], first["side"]),
                "time": f"{first['start_s']:.1f}–{first['stop_s']:.1f} s",
                "cells": cells,
            }
        )
    return found


def _proof(row: ProofRow) -> Context:
    known = max(row["known_s"], 1e-9)
    longest = max(row["broken"], key=lambda s: s["stop_s"] - s["start_s"], default=None)
    where = "" if longest is None else f"longest {longest['start_s']:.1f}–{longest['stop_s']:.1f} s"
    return {
        "wheel": row["wheel"],
        "F": _number(row["F_most"], 2),
        "D": _number(row["D_most"], 2),
        "V": _number(row["V_most"], 3),
        "broken": f"{row['broken_s']:.1f} s ({100 * row['broken_s'] / known:.1f} %)",
        "where": where,
        "uncontrolled": f"{row['uncontrolled_s']:.1f} s",
    }


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _band(band: BandRow | None, digits: int) -> str:
    return "" if band is None else f"{band['low']:.{digits}f}–{band['high']:.{digits}f}"
