"""A run of `mfhca simulate`: simulate, write, and say what was written."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from cli.terminal.console import Terminal
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.api.simulating import MadeLog
    from diagnosis.api.simulation_options import SimulateRequest
    from replay.simulation.options import SimulatedMission


def run_simulation(terminal: Terminal, request: SimulateRequest, json: bool) -> None:
    """Simulate a mission, and write its log and its truth."""
    with terminal.progress(Stage.SIMULATING) as progress:
        from diagnosis.api.simulating import write_simulation

        made, mission = write_simulation(request, progress)
    for text in made.notes:
        terminal.note(text)
    _show(terminal, made, mission, request.preset, json)


def _preset_text(name: str) -> str:
    from replay.simulation.presets import PRESETS

    return f"{name}: {PRESETS[name].text}"


def _loop(mission: SimulatedMission) -> tuple[float, float]:
    """Mean |v_a − v_c| with the true speed [m/s] and mean |u| over the wheels."""
    import numpy as np

    wheels = mission.options.machine.wheels
    error = [np.abs(mission.actual[f"wheel.{w}.v"] - mission.actual[f"wheel.{w}.v_ref"]).mean() for w in wheels]
    effort = [np.abs(mission.columns[f"wheel.{w}.u"]).mean() for w in wheels]
    return float(np.mean(error)), float(np.mean(effort))


def _show(terminal: Terminal, made: MadeLog, mission: SimulatedMission, named: str | None, json: bool) -> None:
    words = ["mfhca", "diagnose", str(made.log)]
    preset = None if named is None else _preset_text(named)
    error, effort = _loop(mission)
    count, duration = len(made.truth.intervals), made.truth.duration_s
    if json:
        terminal.show_json(
            {
                "log": str(made.log),
                "truth": str(made.truth_file),
                "faults": count,
                "duration_s": duration,
                "diagnose": words,
            }
            | {"tracking_error": error, "control_effort": effort}
            | ({} if preset is None else {"preset": preset})
        )
        return
    from cli.tables.layout import key_values

    rows = [
        ("log", f"{made.log}  ({made.format}, {duration:g} s at {mission.options.rate_hz:g} Hz)"),
        ("truth", f"{made.truth_file}  ({count} fault{'' if count == 1 else 's'})"),
    ]
    rows.append(("loop", f"mean |v_a − v_c| {error:.4f} m/s, mean |u| {100 * effort:.3g} % of opening"))
    if preset is not None:
        rows.append(("preset", preset))
    terminal.show(key_values([*rows, ("next", shlex.join(words))]))
