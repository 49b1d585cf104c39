"""What a notebook shows of a result: a few lines that explain themselves, without scripts or requests."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.api.figure_style import COLOURS, colour_of
from diagnosis.api.verdict import Verdict, assumed_words
from diagnosis.pages.environment import environment
from diagnosis.pages.labels import bounded, made_visible, sat_text
from diagnosis.results.candidates import label_of
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Verdict as Status

if TYPE_CHECKING:
    import jinja2

_SHOWN = 20


def html_of(document: ReportDocument, verdict: Verdict) -> str:
    """Verdict, why, what to do, and the worst faults, as a fragment of HTML; names from logs are made visible and inert."""
    report = made_visible(document)
    log = report["log"]
    return _template().render(
        verdict=made_visible(asdict(verdict) | {"headline": verdict.headline, "why": verdict.why}),
        colour=colour_of(Status(report["verdict"]["status"]).symbol),
        muted=COLOURS["muted"],
        mission=", ".join(str(file["path"]) for file in log["files"]),
        log=log,
        assumed=assumed_words(report),
        faults=[_fault(f, words_of(report["machine"])) for f in report["intervals"][:_SHOWN]],
        more=max(len(report["intervals"]) - _SHOWN, 0),
    )


def _fault(fault: IntervalRow, words: MachineWords) -> dict[str, str]:
    sat, epsilon = fault["sat"], fault["epsilon"]
    return {
        "id": fault["id"],
        "part": words.part_words(fault["kind"], fault["component"], fault["side"]),
        "mode": label_of(fault).lower(),
        "colour": colour_of(fault["mode"]),
        "time": f"{fault['start_s']:.2f} to {fault['stop_s']:.2f}",
        "epsilon": "–" if epsilon is None else bounded(epsilon, 2),
        "sat": "–" if sat is None else sat_text(sat["mean"], sat["unit"], words),
        "p": f"{fault['probability']:.3f}",
        "severity": fault["severity"],
    }


@lru_cache
def _template() -> jinja2.Template:
    return environment(Path(__file__).parent).get_template("notebook.html.j2")
