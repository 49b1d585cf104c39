"""Constants of simulated healthy machines are found within what is stated; faults and wrong units are not learned."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.fitting.document import fit_document, fit_toml
from diagnosis.fitting.missions import FitResult, fit_missions
from replay.errors import NotJudged
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import Control, Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

WHEELS = ("FR", "FL", "RR", "RL")
# one machine: K = 2.4 m/s, tau = 0.25 s, d = 0.2 m, lambda = 1 s/m in every mission
SAME = PlantOptions(wheel_spread=0.0)
DEAD = PlantOptions(wheel_spread=0.0, dead_zone=0.05)


@cache
def mission(
    seed: int,
    coupling: str = "free",
    *,
    seconds: float = 60.0,
    rate: float = 100.0,
    plant: PlantOptions = SAME,
    faults: tuple[FaultSpec, ...] = (),
) -> Mission:
    options = SimulationOptions(
        scenario="healthy",
        seed=seed,
        duration_s=seconds,
        rate_hz=rate,
        evidence="base",
        coupling=coupling,  # type: ignore[arg-type]
        plant=plant,
        faults=faults,
    )
    simulated = simulate_mission(options)
    items = {
        name: Signal(name, simulated.stamps, x, SignalSource(column=name), "sim", False)
        for name, x in simulated.columns.items()
    }
    signals = Signals(items, {})
    return Mission((), signals, align(signals))


def values(result: FitResult, leaf: str) -> list[float]:
    return [c.value for c in result.constants if c.key.startswith("plant.") and c.key.endswith(f".{leaf}") and c.value]


def written(result: FitResult) -> set[str]:
    return {c.key for c in result.constants if c.written}


@pytest.fixture(scope="module")
def free() -> FitResult:
    return fit_missions([mission(s, rate=200.0, plant=DEAD) for s in (3, 4, 5)], haulotte())


@pytest.fixture(scope="module")
def ground() -> FitResult:
    return fit_missions([mission(s, "ground") for s in (3, 4)], haulotte())


def test_constants_of_free_wheels(free: FitResult) -> None:
    assert values(free, "K") == pytest.approx([2.4] * 4, rel=0.03)
    assert values(free, "tau") == pytest.approx([0.25] * 4, rel=0.03)
    assert values(free, "dead") == pytest.approx([0.05] * 4, abs=0.005)
    assert free.machine.control.law == "opposed"
    assert free.machine.control.lambda_ == pytest.approx(1.0, rel=0.1)
    assert free.machine.control.zeta == pytest.approx(1000.0, rel=0.03)
    assert not free.unit_errors


def test_constants_on_the_ground(ground: FitResult) -> None:
    assert values(ground, "K") == pytest.approx([2.4] * 4, rel=0.05)
    assert values(ground, "tau") == pytest.approx([0.25] * 4, rel=0.2)
    offsets = [w.offset for w in ground.machine.geometry.wheels.values()]  # type: ignore[union-attr]
    assert offsets == pytest.approx([-0.2, 0.2, -0.2, 0.2], rel=0.1)
    assert all(0.002 < load < 0.02 for load in values(ground, "load"))


def test_truth_lies_within_three_standard_deviations(free: FitResult, ground: FitResult) -> None:
    for result, truths in ((free, {"K": 2.4, "dead": 0.05}), (ground, {"K": 2.4})):
        for c in result.constants:
            truth = truths.get(c.key.rpartition(".")[2])
            if c.key.startswith("plant.") and truth is not None and c.value is not None:
                assert c.std is not None
                assert abs(c.value - truth) < 3 * c.std, c.key


def test_noise_of_every_measured_channel(free: FitResult) -> None:
    for w in WHEELS:
        noise = free.machine.noise[f"wheel.{w}.v"]
        assert noise.std == pytest.approx(0.004, rel=0.05)
        assert noise.lsb == pytest.approx(0.00154, rel=0.01)
    assert set(free.machine.noise) == {f"wheel.{w}.v" for w in WHEELS} | {"steer.front.phi", "steer.rear.phi"}


def test_no_steering_leaves_the_offset_as_it_is() -> None:
    straight = mission(3)
    names = {"steer.front.phi", "steer.rear.phi"}
    items = {
        n: replace(s, values=np.zeros_like(s.values)) if n in names else s for n, s in straight.signals.items.items()
    }
    signals = Signals(items, {})
    result = fit_missions([Mission((), signals, align(signals))], haulotte())
    offset = next(c for c in result.constants if c.key == "geometry.offset")
    assert not offset.written
    assert result.machine.geometry == haulotte().geometry


@pytest.mark.parametrize("loss", campaign([(Side.ACTUATOR, 0.2), (Side.SENSOR, 0.4), (Side.ACTUATOR, 0.5)]), ids=str)
def test_a_mission_that_is_faulty_half_its_time_is_not_learned(ground: FitResult, loss: tuple[Side, float]) -> None:
    fault = FaultSpec("FR", loss[0], FaultMode.INEFFICIENT, 30.0, 60.0, loss[1])
    healthy = [mission(s, "ground") for s in (3, 4)]
    result = fit_missions([*healthy, mission(5, "ground", faults=(fault,))], haulotte())
    assert values(result, "K") == pytest.approx(values(ground, "K"), rel=0.03)
    assert any("wheel FR" in text for text in result.left_out)


def test_a_wheel_that_is_faulty_too_often_is_refused() -> None:
    fault = FaultSpec("RL", Side.SENSOR, FaultMode.INEFFICIENT, 33.0, 60.0, 0.5)
    result = fit_missions([mission(3, faults=(fault,))], haulotte())
    assert "RL" not in result.machine.plant.wheels
    assert {"FR", "FL", "RR"} <= set(result.machine.plant.wheels)
    assert any(text.startswith("wheel RL: ") for text in result.left_out)


def test_a_wheel_unlike_the_others_is_refused() -> None:
    fault = FaultSpec("RL", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.0, 60.0, 0.5)
    result = fit_missions([mission(3, faults=(fault,))], haulotte())
    assert any("wheel RL" in text and "disagrees with the other wheels" in text for text in result.left_out)
    assert "RL" not in result.machine.plant.wheels
    assert fit_toml(result).count("disagrees with the other wheels") == 1  # the reason is given once


def test_too_little_driving_is_no_fit() -> None:
    with pytest.raises(NotJudged, match="are needed"):
        fit_missions([mission(3, seconds=8.0)], haulotte())


def test_same_missions_same_bytes() -> None:
    once, again = (fit_missions([mission(3, "ground", seconds=20.0)], haulotte()) for _ in range(2))
    assert fit_toml(again) == fit_toml(once)


def test_document_and_machine_file(ground: FitResult, tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("fit") / "machine.toml"
    file.write_text(fit_toml(ground), encoding="utf-8")
    assert load_machine(file) == ground.machine
    text = file.read_text(encoding="utf-8")
    assert "from 2 healthy missions" in text
    assert "# control.psi0: not given; not identifiable" in text
    document = fit_document(ground)
    assert document["schema"] == "mfhca-fit/1"
    assert len(document["constants"]) == len(ground.constants)


def test_a_real_motors_effort_map_comes_from_many_runs(reference_data: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        """
[machine]
wheels = ["M"]
[geometry]
max_speed = 400
[control]
law = "none"
u_max = 100
[sources]
"*.csv" = { time = "Rel Time", time_unit = "ms" }
[signals]
"wheel.M.v_ref" = { column = "Desired Speed", unit = "m/s" }
"wheel.M.v" = { column = "Actual Speed", unit = "m/s" }
"wheel.M.u" = { column = "Shaft Control Effort", unit = "1" }
""",
        encoding="utf-8",
    )
    machine = load_machine(rig)
    missions = []
    for log in sorted((reference_data / "fault_data/rosa/healthy_mode").glob("*.csv.gz"))[::3]:
        file = tmp_path / log.name.removesuffix(".gz")
        pd.read_csv(log, skipinitialspace=True).iloc[1:-1].to_csv(file, index=False)  # lone rows at both ends
        missions.append(load_mission([file], machine))
    halves = [fit_missions(part, machine) for part in (missions[::2], missions[1::2])]
    plants = [half.machine.plant.wheels["M"] for half in halves]
    assert all(not half.unit_errors for half in halves)
    for name in ("K", "dead"):
        a, b = (getattr(p, name) for p in plants)
        stds = [getattr(p, f"{name}_std") for p in plants]
        assert abs(a - b) < 2 * np.hypot(*stds), (name, a, b, stds)
    assert all(10 < p.K < 22 and 3 < p.dead < 12 for p in plants)
    tau = next(c for c in halves[0].constants if c.key == "plant.M.tau")
    assert "never changes" in tau.why


def drive_mission(seed: int) -> Mission:
    """20 s at 50 Hz of one drive, v = 8·(u − 0.2) with a lag of 0.3 s, in a proportional-integral loop (0.2, 0.8 s)."""
    rng = np.random.default_rng(seed)
    n, dt, kp, ti = 1000, 0.02, 0.2, 0.8
    command = 1.5 + 0.5 * seed + 0.5 * np.repeat(rng.uniform(-1, 1, 5), n // 5)
    y, u = np.empty(n), np.empty(n)
    v, effort = command[0], command[0] / 8 + 0.2
    integral = effort
    for k in range(n):
        v += dt / 0.3 * (-v + 8 * (effort - 0.2) + rng.normal(0, 0.4))
        y[k], u[k] = v + rng.normal(0, 0.03), effort
        integral += kp / ti * dt * (command[k] - y[k])
        effort = integral + kp * (command[k] - y[k])
    stamps = 20_000_000 * np.arange(n, dtype=np.int64)
    signals = Signals(
        {
            f"wheel.M.{leaf}": Signal(f"wheel.M.{leaf}", stamps, x, SignalSource(column=leaf), "rig", False)
            for leaf, x in (("v_ref", command), ("v", y), ("u", u))
        },
        {},
    )
    return Mission((), signals, align(signals))


RIG = Machine("rig", "", ("M",), None, control=Control(law="none"), max_speed=5.0)


def test_a_single_drive_is_measured_into_the_machine_file(tmp_path: Path) -> None:
    result = fit_missions([drive_mission(s) for s in (1, 2, 3)], RIG)
    found = {c.key: c for c in result.constants if c.written and c.key.startswith("drive.M.")}
    assert found["drive.M.echo.gains"].value == pytest.approx(-1 / 0.2, rel=0.05)
    assert found["drive.M.echo.memory_s"].value == pytest.approx(0.8, rel=0.2)
    assert found["drive.M.effort.offset"].value == pytest.approx(0.2, abs=0.05)
    assert found["drive.M.effort.slope"].value == pytest.approx(1 / 8, rel=0.1)
    assert found["drive.M.effort.slope"].missions == 3
    path = tmp_path / "machine.toml"
    path.write_text(fit_toml(result), encoding="utf-8")
    assert "# drive.M.effort.slope = 0.1" in path.read_text(encoding="utf-8")
    assert load_machine(path).drives == result.machine.drives


def test_what_a_single_drive_did_not_show_is_said_and_stays(tmp_path: Path) -> None:
    known = fit_missions([drive_mission(s) for s in (1, 2, 3)], RIG).machine
    result = fit_missions([drive_mission(4)], known)
    slope = next(c for c in result.constants if c.key == "drive.M.effort.slope")
    assert (slope.value, slope.written) == (None, False)
    assert "three missions" in slope.why
    assert "drive.M.effort.slope: unchanged; not identifiable: three missions" in fit_toml(result)
    assert result.machine.drives["M"].effort == known.drives["M"].effort
    assert result.machine.drives["M"].echo != known.drives["M"].echo


def test_wheels_of_a_machine_with_geometry_are_no_single_drives(free: FitResult) -> None:
    assert [c.key for c in free.constants if c.key.startswith("drive.")] == []
    assert dict(free.machine.drives) == {}


def test_a_short_faulty_mission_is_no_internal_error() -> None:
    """Twenty seconds in which openings are zero: constants are left out with the reason."""
    simulated = simulate_mission(SimulationOptions(scenario="random", seed=3, duration_s=20.0, rate_hz=100.0))
    items = {
        name: Signal(name, stamps, values, SignalSource(column=name), "sim", False)
        for name, stamps, values in simulated.series()
    }
    signals = Signals(items, {})
    found = fit_missions([Mission((), signals, align(signals))], haulotte())
    assert found.machine.plant.wheels == haulotte().plant.wheels
    assert any("fewer than 8 steady windows" in text for text in found.left_out)
