"""The walk of a counterfactual replay: diagnose, abduct, replay the recorded law, then the others, and say how sure that is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from diagnosis.assess import assess_components
from diagnosis.counterfactual.abduct import Abducted, abduct
from diagnosis.counterfactual.bands import EFFORT_OFF, ERROR_OFF, band, bands, spread_of
from diagnosis.counterfactual.document import (
    SCHEMA,
    CounterfactualDocument,
    LawRow,
    PlantRow,
    SelfReplayRow,
)
from diagnosis.counterfactual.figures import law_figures, recoveries
from diagnosis.counterfactual.law import PRINTED, Law, asked_laws, check_laws, recorded_law
from diagnosis.counterfactual.proof import proof_of, proof_rows
from diagnosis.counterfactual.tuning import tuned
from replay.control.loop import Replay, replay_loop
from replay.control.lyapunov import ProofTerms
from replay.controllers.choice import Controller
from replay.counterfactual.predict import predict
from replay.counterfactual.world import OtherWorld
from replay.errors import NotJudged
from replay.machine.config import Machine
from replay.mission import load_mission
from replay.progress import Progress, Stage, Subscriber, silent
from replay.version import __version__

Array = NDArray[np.float64]

ERROR_WITHIN, EFFORT_WITHIN = 0.02, 0.05  # of the recorded figures, for self-replay
_LEAST_ERROR = 2e-4  # that counts, a tenth of a speed sensor's resolution [m/s]


@dataclass(frozen=True)
class Request:
    """What is asked of a mission.

    Attributes
    ----------
    laws : tuple[str, ...]
        Of `diagnosis.counterfactual.law.LAW_NAMES`, or ``all``.
    settings : Mapping[str, float]
        Parameters of the one law that is asked for.
    recorded : Controller or None
        The law that ran, where the log does not tell it.
    tune_on : tuple[Path, ...]
        Healthy missions to tune the laws on.
    draws : int
        Of the Monte Carlo; 0: none.
    start_s, stop_s : float or None
        Part of the mission [s].
    """

    laws: tuple[str, ...] = ("all",)
    settings: Mapping[str, float] = field(default_factory=dict)
    recorded: Controller | None = None
    tune_on: tuple[Path, ...] = ()
    draws: int = 12
    start_s: float | None = None
    stop_s: float | None = None


@dataclass(frozen=True)
class CounterfactualResult:
    """What comes out.

    Attributes
    ----------
    document : CounterfactualDocument
        For JSON.
    abducted : Abducted
        The recorded mission.
    wheels : tuple[str, ...]
        Names of its columns.
    worlds : Mapping[str, OtherWorld]
        By law; ``recorded`` is the recorded law replayed in the loop.
    proof : ProofTerms or None
        Terms of the stability proof, where MFHCA ran.
    """

    document: CounterfactualDocument
    abducted: Abducted
    wheels: tuple[str, ...]
    worlds: Mapping[str, OtherWorld]
    proof: ProofTerms | None = None


def counterfactual(
    paths: Sequence[Path], machine: Machine, request: Request, progress: Subscriber = silent
) -> CounterfactualResult:
    """Predict a recorded mission under other laws.

    Parameters
    ----------
    paths : Sequence[Path]
        The mission's files.
    machine : Machine
        The machine.
    request : Request
        Which laws.
    progress : Subscriber
        Called at the beginning of each stage.

    Raises
    ------
    LogError
        Where a file cannot be read.
    NotJudged
        Where the mission lacks what is needed, its law is not known, or the recorded law does not reproduce it.
    ConfigError
        Where a law or a parameter is not known.
    """
    check_laws(request.laws, request.settings)
    name = ", ".join(p.name for p in paths)
    replay, abducted = _world(paths, machine, name, request.start_s, request.stop_s, progress)
    if request.recorded is not None:
        recorded = Law("recorded", request.recorded)
    else:
        recorded = recorded_law(replay, machine, name)
    laws = asked_laws(request.laws, request.settings, recorded, machine)
    u_max = machine.control.u_max
    progress(Progress(Stage.PREDICTING, "the recorded law"))
    own = predict(abducted.world, abducted.plant, recorded.controller, u_max, recorded.psi0)
    self_replay = _self_replay(abducted, recorded, own, name)
    was_tuned: set[str] = set()
    if request.tune_on:
        healthy = [_world([p], machine, p.name, None, None, progress)[1] for p in request.tune_on]
        for k, law in enumerate(laws):
            if law.name != PRINTED:
                progress(Progress(Stage.TUNING, law.name))
                laws[k] = tuned(law, healthy, u_max)
                was_tuned.add(law.name)
    worlds = {"recorded": own}
    for law in laws:
        progress(Progress(Stage.PREDICTING, law.name))
        worlds[law.name] = predict(abducted.world, abducted.plant, law.controller, u_max, law.psi0)
    progress(Progress(Stage.DRAWING))
    changes = list(bands(abducted, laws, u_max, request.draws)) if request.draws else [None] * len(laws)
    rows = [
        _row(law, abducted, machine, worlds[law.name].u, worlds[law.name].shift, c, was_tuned=law.name in was_tuned)
        for law, c in zip(laws, changes, strict=True)
    ]
    proof = proof_of(abducted, replay, machine)
    document: CounterfactualDocument = {
        "schema": SCHEMA,
        "tool": {"name": "mfhca", "version": __version__},
        "log": [p.name for p in paths],
        "machine": machine.name,
        "duration_s": len(own.u) * abducted.world.dt,
        "rate_hz": 1.0 / abducted.world.dt,
        "known_s": {
            w: float(np.count_nonzero(abducted.known[:, i])) * abducted.world.dt for i, w in enumerate(machine.driven)
        },
        "faults": len(abducted.faults),
        "readings": [{"name": r.name, "value": r.value, "detail": r.detail} for r in replay.readings],
        "plant": _plant_rows(abducted, machine),
        "plant_note": abducted.fit.note,
        "self_replay": self_replay,
        "recorded": _row(recorded, abducted, machine, abducted.world.u, np.zeros_like(own.shift)),
        "laws": rows,
        "proof": [] if proof is None else proof_rows(proof, machine, abducted.world.dt),
        "draws": request.draws,
        "notes": list(abducted.notes),
    }
    return CounterfactualResult(document, abducted, machine.driven, worlds, proof)


def _world(
    paths: Sequence[Path],
    machine: Machine,
    name: str,
    start_s: float | None,
    stop_s: float | None,
    progress: Subscriber,
) -> tuple[Replay, Abducted]:
    """A mission, diagnosed."""
    mission = load_mission(paths, machine, start_s=start_s, stop_s=stop_s, progress=progress)
    progress(Progress(Stage.REPLAYING_LOOP))
    replay = replay_loop(mission.timeline, machine)
    found = assess_components(mission.timeline, replay, machine, machine.wheels, progress)
    return replay, abduct(mission.timeline, replay, machine, found, name)


def _self_replay(abducted: Abducted, law: Law, own: OtherWorld, name: str) -> SelfReplayRow:
    """What the recorded law makes of the mission.

    Raises
    ------
    NotJudged
        Where it does not reproduce it.
    """
    world, known = abducted.world, abducted.known
    if not known.any():
        raise NotJudged(
            f"{name}: no wheel's true speed is known at any time, so that no law can be compared with the recording"
        )
    before, after = (
        float(np.abs(world.speed + s - world.v_ref)[known].mean()) for s in (np.zeros_like(own.shift), own.shift)
    )
    effort, replayed = float(np.abs(world.u).mean()), float(np.abs(own.u).mean())
    row: SelfReplayRow = {
        "law": law.controller.name if law.controller.name != "mfhca" else f"mfhca, {law.controller.reading}",
        "gains": law.controller.own,
        "error_recorded": before,
        "error_replayed": after,
        "effort_recorded": effort,
        "effort_replayed": replayed,
        "shift": float(np.abs(own.shift[known]).mean()),
    }
    same = abs(after - before) <= max(ERROR_WITHIN * before, _LEAST_ERROR)
    if not (same and abs(replayed - effort) <= EFFORT_WITHIN * max(effort, 1e-9)):
        raise NotJudged(
            f"{name}: self-replay: the law found in it ({row['law']}) gives a mean |e| of {after:.4f} instead of {before:.4f} m/s and "
            f"an effort of {replayed:.4f} instead of {effort:.4f} (allowed: {100 * ERROR_WITHIN:.0f} % and {100 * EFFORT_WITHIN:.0f} %), "
            "so another law cannot be predicted; name the law that ran with --recorded, its parameters in [control] of a machine "
            "file, or choose a part of the mission with --start and --end"
        )
    return row


def _row(
    law: Law,
    abducted: Abducted,
    machine: Machine,
    u: Array,
    shift: Array,
    changes: tuple[Array, Array] | None = None,
    *,
    was_tuned: bool = False,
) -> LawRow:
    """One law with its commands and by how much the wheels turn faster than recorded."""
    kind = law.controller.kind
    figures = law_figures(abducted, machine, u, shift)
    error, effort = (np.empty(0), np.empty(0)) if changes is None else changes
    return {
        "law": law.name,
        "title": "MFHCA as printed" if law.name == PRINTED else kind.title,
        "parameters": kind.parameters,
        "gains": law.controller.own,
        "tuned": was_tuned,
        "figures": figures,
        "error_band": band(figures["tracking_error"]["mission"], error, ERROR_OFF),
        "effort_band": band(figures["control_effort"]["mission"], effort, EFFORT_OFF),
        "recoveries": recoveries(abducted, machine, shift),
    }


def _plant_rows(abducted: Abducted, machine: Machine) -> list[PlantRow]:
    spread = spread_of(abducted)
    return [
        {
            "wheel": wheel,
            "K": plant.K,
            "tau": plant.tau,
            "grip": float(abducted.plant.grip[i]),
            "K_std": float(spread.K[i]),
            "tau_std": float(spread.tau[i]),
        }
        for i, (wheel, plant) in enumerate(zip(machine.driven, abducted.fit.plants, strict=True))
        if plant is not None
    ]
