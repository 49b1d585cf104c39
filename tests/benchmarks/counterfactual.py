"""How well a counterfactual predicts: against the same mission simulated again under the other law.

    python tests/benchmarks/counterfactual.py                       # 12 missions, plant and faults as diagnosed, base evidence
    python tests/benchmarks/counterfactual.py --plant true          # the simulator's own plant, speeds and faults
    python tests/benchmarks/counterfactual.py --evidence direct --ice 0.25

Missions: scenarios paper and random, wheels on the ground and free, reporting seeds 2000 to 2002, 240 s at 1 kHz, recorded under
MFHCA (ζ = 1000). What self-replay refuses is named and not counted. Predicted and simulated again, with the same seed and so the same noise, faults and ground: MFHCA with ζ = 2400
and the six other laws. Compared: mean |v − v_c| over the samples of which the log tells the speed, and mean |u|.
With --draws N, also whether the stated 90 % bands hold what was simulated.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from diagnosis.assess import assess_components
from diagnosis.counterfactual.abduct import Abducted, abduct
from diagnosis.counterfactual.bands import EFFORT_OFF, ERROR_OFF, band, bands
from diagnosis.counterfactual.law import Law, recorded_law
from diagnosis.counterfactual.run import EFFORT_WITHIN, ERROR_WITHIN
from replay.control.kinematics import speed_ratios, wheel_angles
from replay.control.loop import replay_loop
from replay.controllers.choice import CONTROLLER_NAMES, Controller
from replay.counterfactual.predict import predict
from replay.counterfactual.world import CoupledPlant, RecordedWorld, linear_map
from replay.errors import NotJudged
from replay.export.mission import write_mission
from replay.faults import Side
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.progress import silent
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import mission_parts, simulate_mission

ZETA, OTHER_ZETA = 1000.0, 2400.0
LAWS = (Controller("mfhca", {"zeta": OTHER_ZETA}), *(Controller(name) for name in CONTROLLER_NAMES[1:]))


@dataclass(frozen=True)
class Case:
    """A mission with what is known of it, and the law that ran; `abducted` where it comes from a diagnosis."""

    mission: SimulatedMission
    world: RecordedWorld
    plant: CoupledPlant
    recorded: Controller
    abducted: Abducted | None = None
    psi0: tuple[float, ...] = ()


def stacked(mission: SimulatedMission, leaf: str, *, actual: bool) -> np.ndarray:
    """Columns of all wheels, shape (n, wheels)."""
    source = mission.actual if actual else mission.columns
    return np.column_stack([source[f"wheel.{w}.{leaf}"] for w in mission.truth.wheels])


def true_case(mission: SimulatedMission) -> Case:
    """Plant, speeds, openings, faults and ground of the simulator."""
    options = mission.options
    _, faults, model = mission_parts(options)
    wheels, t = mission.truth.wheels, np.arange(options.samples) / options.rate_hz
    y = stacked(mission, "v", actual=False)
    let = {side: np.ones(y.shape) for side in (Side.SENSOR, Side.ACTUATOR)}
    held = {side: np.zeros(y.shape, np.bool_) for side in let}
    for fault in faults:
        if fault.component in wheels:
            rows = (t >= fault.start_s - 1e-9) & (t < fault.stop_s - 1e-9)
            let[fault.side][rows, wheels.index(fault.component)] = 1.0 - fault.epsilon
            held[fault.side][rows, wheels.index(fault.component)] |= bool(np.isnan(fault.sat))
    geometry = options.machine.geometry
    assert geometry is not None
    phi = np.column_stack([mission.actual[f"steer.{a}.phi"] for a in ("front", "rear")])
    rate = np.gradient(wheel_angles(phi, geometry), axis=0) * options.rate_hz
    world = RecordedWorld(
        dt=1.0 / options.rate_hz,
        v_ref=stacked(mission, "v_ref", actual=True),
        y=y,
        u=stacked(mission, "u", actual=False),
        opening=stacked(mission, "u_applied", actual=True),
        speed=stacked(mission, "v", actual=True),
        let_sensor=let[Side.SENSOR],
        let_valve=let[Side.ACTUATOR],
        held_sensor=held[Side.SENSOR],
        held_valve=held[Side.ACTUATOR],
        ratio=speed_ratios(phi, geometry),
        turn=rate * np.array([w.offset for w in geometry.wheels.values()]),
        ground=_ice(mission, model),
    )
    count, droop = len(wheels), options.plant.droop
    openings, speeds = linear_map(model.K, np.full(count, options.plant.dead_zone), 1.0)
    weight = options.plant.mass * 9.81 / count
    plant = CoupledPlant(
        tau=model.tau,
        openings=openings,
        speeds=speeds,
        play=np.zeros(count),
        grip=np.full(count, droop * options.plant.slip_stiffness),
        most=np.full(count, droop * options.plant.friction * weight * (options.coupling == "ground")),
        creep=0.05,
        flow=model.speed_limit,
    )
    return Case(mission, world, plant, Controller("mfhca", {"zeta": ZETA}))


def _ice(mission: SimulatedMission, model: object) -> np.ndarray:
    """Share of firm ground's friction under each wheel along the recorded path, shape (n, wheels)."""
    x, y, yaw = (mission.actual[f"body.{k}"] for k in ("x", "y", "yaw"))
    p = mission_parts(mission.options)[2]
    out = np.ones((x.size, p.x.size))
    for i in range(p.x.size):
        east = x + np.cos(yaw) * p.x[i] - np.sin(yaw) * p.y[i]
        north = y + np.sin(yaw) * p.x[i] + np.cos(yaw) * p.y[i]
        height = sum(np.cos(a * east + b * north + c) for a, b, c in p.ice_waves)
        out[height > p.ice_level, i] = p.mu_ice / p.mu
    return out


def diagnosed_case(mission: SimulatedMission) -> Case:
    """Plant, speeds and faults as the diagnosis of the log has them."""
    machine = haulotte()
    with TemporaryDirectory() as folder:
        log = Path(folder) / "mission.mcap"
        write_mission(mission, log, "mcap")
        timeline = load_mission([log], machine).timeline
    replay = replay_loop(timeline, machine)
    found = assess_components(timeline, replay, machine, machine.wheels, silent)
    abducted = abduct(timeline, replay, machine, found, log.name)
    law = recorded_law(replay, machine, log.name)
    return Case(mission, abducted.world, abducted.plant, law.controller, abducted, law.psi0)


def errors(case: Case) -> dict[str, tuple[float, float, float]]:
    """Relative error of mean |e| and mean |u| by law, and the simulated mean |e|; for ``self`` mean |Δv| instead of the latter."""
    world, mission = case.world, case.mission
    known = np.isfinite(world.speed)
    noise = world.speed - stacked(mission, "v", actual=True)  # what the log adds to the true speed
    own = predict(world, case.plant, case.recorded, 1.0)
    before, after = (_mean(world.speed + s - world.v_ref, known) for s in (np.zeros_like(own.shift), own.shift))
    effort = np.abs(own.u).mean() / np.abs(world.u).mean() - 1.0
    found = {"self": (after / before - 1.0, float(effort), _mean(own.shift, known))}
    for law in LAWS:
        predicted = predict(world, case.plant, law, 1.0)
        other = replace(
            mission.options,
            controller=None if law.name == "mfhca" else law,
            zeta=law.own["zeta"] if law.name == "mfhca" else None,
        )
        again = simulate_mission(other)
        truth = _mean(stacked(again, "v", actual=True) + noise - world.v_ref, known)
        effort = np.abs(predicted.u).mean() / np.abs(stacked(again, "u", actual=False)).mean() - 1.0
        error = _mean(world.speed + predicted.shift - world.v_ref, known) / truth - 1.0
        found[f"{law.name} ζ" if law.name == "mfhca" else law.name] = error, float(effort), truth
    return found


def held(case: Case, found: dict[str, tuple[float, float, float]], draws: int) -> tuple[int, int, int]:
    """Predictions whose bands hold the simulated error, the simulated effort, and all of them."""
    if case.abducted is None:
        return 0, 0, 0
    laws = [Law(law.name, law, case.psi0) for law in LAWS]
    error, effort, count = 0, 0, 0
    known = np.isfinite(case.world.speed)
    for law, (e, u) in zip(laws, bands(case.abducted, laws, 1.0, draws), strict=True):
        _, off_u, truth = found[f"{law.name} ζ" if law.name == "mfhca" else law.name]
        predicted = predict(case.world, case.plant, law.controller, 1.0)
        level = float(np.abs(predicted.u).mean())
        by_error = band(_mean(case.world.speed + predicted.shift - case.world.v_ref, known), e, ERROR_OFF)
        by_effort = band(level, u, EFFORT_OFF)
        assert by_error is not None
        assert by_effort is not None
        error += by_error["low"] <= truth <= by_error["high"]
        effort += by_effort["low"] <= level / (1.0 + off_u) <= by_effort["high"]
        count += 1
    return error, effort, count


def _mean(x: np.ndarray, known: np.ndarray) -> float:
    return float(np.abs(x)[known].mean())


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line per mission, then median and worst of each law."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plant", choices=("true", "identified"), default="identified")
    parser.add_argument("--evidence", choices=("base", "spool", "direct"), default="base")
    parser.add_argument("--first", type=int, default=2000)
    parser.add_argument("--count", type=int, default=3)
    parser.add_argument("--duration", type=float, default=240.0)
    parser.add_argument("--rate", type=float, default=1000.0)
    parser.add_argument("--ice", type=float, default=0.0)
    parser.add_argument("--draws", type=int, default=0)
    asked = parser.parse_args(arguments)
    covered = np.zeros(3, dtype=np.int64)
    rows: list[dict[str, tuple[float, float, float]]] = []
    seeds = range(asked.first, asked.first + asked.count)
    for scenario, coupling, seed in product(("paper", "random"), ("ground", "free"), seeds):
        options = SimulationOptions(
            scenario=scenario,  # type: ignore[arg-type]
            seed=seed,
            duration_s=asked.duration,
            rate_hz=asked.rate,
            evidence=asked.evidence,
            coupling=coupling,  # type: ignore[arg-type]
            ice=asked.ice if coupling == "ground" else 0.0,
            zeta=ZETA,
        )
        mission = simulate_mission(options)
        try:
            case = true_case(mission) if asked.plant == "true" else diagnosed_case(mission)
        except NotJudged as refused:
            print(f"{scenario} {coupling} {seed}: refused: {refused}", flush=True)
            continue
        found = errors(case)
        if abs(found["self"][0]) > ERROR_WITHIN or abs(found["self"][1]) > EFFORT_WITHIN:
            words = f"self-replay {100 * found['self'][0]:+.1f}/{100 * found['self'][1]:+.1f} %"
            print(f"{scenario} {coupling} {seed}: refused: {words}", flush=True)
            continue
        rows.append(found)
        covered += held(case, found, asked.draws) if asked.draws else (0, 0, 0)
        words = ", ".join(f"{law} {100 * e:+.1f}/{100 * u:+.1f}" for law, (e, u, _) in rows[-1].items())
        print(
            f"{scenario} {coupling} {seed}: error/effort [%]: {words}; self |Δv| {1e3 * rows[-1]['self'][2]:.2f} mm/s",
            flush=True,
        )
    for law in rows[0]:
        error = 100 * np.abs([r[law][0] for r in rows])
        effort = 100 * np.abs([r[law][1] for r in rows])
        print(
            f"{law:12} |e| median {np.median(error):.1f} %, worst {error.max():.1f} %; effort median {np.median(effort):.1f} %, "
            f"worst {effort.max():.1f} %"
        )
    if covered[2]:
        error_held, effort_held, count = covered.tolist()
        print(
            f"90 % bands hold |e| {100 * error_held / count:.0f} %, effort {100 * effort_held / count:.0f} % of {count} predictions"
        )


if __name__ == "__main__":
    main()
