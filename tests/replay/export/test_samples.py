"""The sample missions are what their maker writes, and their machine files find every signal."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.machine.toml_file import load_machine
from replay.mission import read_signals
from replay.simulation.options import SimulatedMission
from replay.simulation.run import simulate_mission
from replay.truth import read_truth

FOLDER = Path(__file__).resolve().parents[3] / "sample_logs"
PAPER = ("paper.mcap", "paper.bag", "paper_rosbag2", "paper_twincat.csv")
LOGS = ("three_faults.mcap", *PAPER, "healthy_ice.mcap", "spool.mcap", "base.mcap")


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make", FOLDER / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def paper(maker: ModuleType) -> SimulatedMission:
    return simulate_mission(maker.SAMPLES["paper.mcap"][1])


def test_every_sample_has_its_files(maker: ModuleType) -> None:
    assert tuple(maker.SAMPLES) == LOGS
    for name, (machine, _) in maker.SAMPLES.items():
        assert (FOLDER / name).exists()
        assert (FOLDER / machine).is_file()
        assert (FOLDER / f"{Path(name).stem}.truth.json").is_file()
    assert sum(p.stat().st_size for p in FOLDER.rglob("*") if p.is_file()) < 16e6


@pytest.mark.parametrize("name", LOGS)
def test_truth_files_are_up_to_date(maker: ModuleType, name: str) -> None:
    truth = simulate_mission(maker.SAMPLES[name][1]).truth
    stored = read_truth(FOLDER / f"{Path(name).stem}.truth.json")
    assert len(stored.intervals) == len(truth.intervals)
    for a, b in zip(stored.intervals, truth.intervals, strict=True):
        assert (a.component, a.side, a.mode, a.start_s, a.stop_s) == (b.component, b.side, b.mode, b.start_s, b.stop_s)
        assert_allclose([a.epsilon, a.sat_mean, a.sat_std], [b.epsilon, b.sat_mean, b.sat_std], atol=1e-6)


@pytest.mark.parametrize("name", PAPER)
@pytest.mark.parametrize("given", [True, False])
def test_the_papers_mission_is_the_same_in_every_format(
    maker: ModuleType, paper: SimulatedMission, name: str, given: bool
) -> None:
    machine = load_machine(FOLDER / maker.SAMPLES[name][0]) if given else paper.options.machine
    _, signals = read_signals([FOLDER / name], machine)
    expected = {n: (paper.stamps, v) for n, v in paper.columns.items()}
    for group in paper.slow:
        expected |= {n: (group.stamps, v) for n, v in group.columns.items()}
    assert signals.items.keys() == expected.keys()
    for signal, (stamps, values) in expected.items():
        found = signals.items[signal]
        assert found.guessed is not given
        assert_array_equal(found.stamps, stamps)
        # Motor turns to metres per second and back costs the last digits.
        assert_allclose(found.values, values, rtol=1e-9, atol=1e-12)


def test_levels_of_evidence(maker: ModuleType) -> None:
    leaves = {}
    for name in ("spool.mcap", "base.mcap"):
        _, signals = read_signals([FOLDER / name], load_machine(FOLDER / maker.SAMPLES[name][0]))
        leaves[name] = {s.rpartition(".")[2] for s in signals.items}
        assert all(np.isfinite(s.values).all() for s in signals.items.values())
    assert leaves["base.mcap"] == {"v", "omega", "v_ref", "u", "phi", "phi_ref"}
    assert leaves["spool.mcap"] - leaves["base.mcap"] == {"u_applied", "lat", "lon"}
