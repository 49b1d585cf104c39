"""Simulated robots with efforts: fit → machine file → finding → report, and what may be called healthy."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from diagnosis.fitting.document import fit_toml
from diagnosis.fitting.missions import fit_missions
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.document import ReportDocument
from replay.errors import ConfigError
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
SEED = 1507
READY = 4  # the number of a healthy mission of this robot that is ready


@pytest.fixture(scope="module")
def bench() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import efforts  # type: ignore[import-not-found]

    yield efforts
    sys.path.remove(str(BENCHMARKS))


class Skid:
    """A skid-steered robot that logs duties, with a machine file fitted from four healthy missions."""

    def __init__(self, bench: ModuleType, folder: Path) -> None:
        self.bench, self.folder = bench, folder
        self.robot = bench.robot("skid", SEED, duties=True)
        paths = [bench.mission(self.robot, SEED, k, "", folder)[0] for k in range(4)]
        self.plain: Machine = bench.machine_of(paths[0], folder, duties=True)
        self.fit = fit_missions([load_mission([p], self.plain) for p in paths], self.plain)
        written = folder / "fitted.toml"
        written.write_text(fit_toml(self.fit))
        self.machine = load_machine(written)

    def mission(self, k: int, fault: str = "") -> Mission:
        return load_mission([self.bench.mission(self.robot, SEED, k, fault, self.folder)[0]], self.machine)


@pytest.fixture(scope="module")
def skid(bench: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Skid:
    return Skid(bench, tmp_path_factory.mktemp("skid"))


@pytest.fixture(scope="module")
def healthy(skid: Skid) -> Mission:
    return skid.mission(READY)


def told(report: ReportDocument) -> list[tuple[str, str]]:
    return [(i["component"], str(i["side"])) for i in report["intervals"] if i["severity"] != "info"]


def test_the_section_survives_its_file(skid: Skid) -> None:
    assert skid.machine.efforts == skid.fit.machine.efforts
    assert set(skid.machine.efforts) == set(skid.machine.wheels)
    assert all(m.held > 0.05 and max(m.off) < 0.1 for m in skid.machine.efforts.values())


def test_a_robot_with_duties_can_be_ready(skid: Skid, healthy: Mission) -> None:
    assert diagnose_mission(healthy, skid.machine).report["verdict"]["status"] == "ready"
    assert diagnose_mission(healthy, skid.plain).report["verdict"]["status"] == "not_assessed"


@pytest.mark.parametrize("fault", ["motor_faint", "brake_drags"])
def test_a_weak_drive_behind_its_loop_is_named(skid: Skid, fault: str) -> None:
    mission = skid.mission(20, fault)
    assert told(diagnose_mission(mission, skid.plain).report) == []
    found = told(diagnose_mission(mission, skid.machine).report)
    assert {side for _, side in found} == {"actuator"}
    assert len({w for w, _ in found}) == 1


def test_a_torque_clears_no_drive(skid: Skid, healthy: Mission) -> None:
    signals = {n: replace(s, unit="N·m") if n.endswith(".effort") else s for n, s in skid.machine.signals.items()}
    report = diagnose_mission(healthy, replace(skid.machine, signals=signals)).report
    assert report["verdict"]["status"] == "not_assessed"
    assert not told(report)
    assert "the torque or current that it gives" in report["verdict"]["text"]


def test_without_memory_in_the_loop_no_drive_is_cleared(skid: Skid, healthy: Mission) -> None:
    weak = {w: replace(m, held=0.01) for w, m in skid.machine.efforts.items()}
    assert diagnose_mission(healthy, replace(skid.machine, efforts=weak)).report["verdict"]["status"] == "not_assessed"


def test_efforts_that_cannot_be_used_change_nothing(skid: Skid, healthy: Mission) -> None:
    signals = {n: x for n, x in healthy.timeline.signals.items() if not n.endswith(".effort")}
    bare = replace(healthy, timeline=replace(healthy.timeline, signals=signals))
    without = diagnose_mission(bare, skid.machine).report["verdict"]
    noisy = dict(healthy.timeline.signals)
    rng = np.random.default_rng(1)
    for n in [n for n in noisy if n.endswith(".effort")]:
        noisy[n] = noisy[n] + rng.normal(0.0, 5.0, noisy[n].size)
    made = diagnose_mission(replace(healthy, timeline=replace(healthy.timeline, signals=noisy)), skid.machine).report
    assert made["verdict"]["status"] == without["status"] == "not_assessed"
    assert not told(made)


def test_a_wheel_that_is_none_is_refused(skid: Skid) -> None:
    with pytest.raises(ConfigError, match="no such wheel"):
        replace(skid.machine, efforts={"X": next(iter(skid.machine.efforts.values()))})
