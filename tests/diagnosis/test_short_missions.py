"""Missions that are too short to say anything: a sentence or ``not assessed``, never an error of the tool."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from diagnosis.pipeline import diagnose
from diagnosis.results.vocabulary import Verdict
from replay.errors import NotJudged
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

PAPER = haulotte()


@cache
def table(evidence: EvidenceLevel) -> list[str]:
    """A mission of 6 s as CSV lines, the header first."""
    options = SimulationOptions(scenario="healthy", seed=3, duration_s=6.0, rate_hz=1000.0, evidence=evidence)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "whole.csv"
        write_mission(simulate_mission(options), path, "csv")
        return path.read_text(encoding="utf-8").splitlines()


@pytest.mark.turns("evidence")
@pytest.mark.parametrize("evidence", ["direct", "base", "spool"])
@pytest.mark.parametrize("rows", campaign([2, 5000, 600, 30, 200, 1200, 3500], 2))
def test_a_few_seconds_clear_nothing(tmp_path: Path, evidence: EvidenceLevel, rows: int) -> None:
    path = tmp_path / "short.csv"
    path.write_text("\n".join(table(evidence)[: rows + 1]) + "\n", encoding="utf-8")
    if evidence == "base" and rows < 3000:
        with pytest.raises(NotJudged, match="too little driving to judge anything; choose a longer part"):
            diagnose([path], PAPER)
        return
    verdict = diagnose([path], PAPER).report["verdict"]
    assert (verdict["status"], verdict["cleared"]) == (Verdict.NOT_ASSESSED, False)
