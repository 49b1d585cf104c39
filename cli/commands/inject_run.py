"""A run of `mfhca inject`: read, inject, write, and say what was injected."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from cli.terminal.console import Terminal
from diagnosis.api.injecting import InjectRequest, write_injection
from diagnosis.api.inputs import machine_of, mission_paths
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.api.simulating import MadeLog
    from replay.signals.signal import Signals


def run_injection(terminal: Terminal, request: InjectRequest, machine_file: Path | None, json: bool) -> None:
    """Inject faults into a log, and write it with its truth."""
    mission_paths(request.paths)
    request.check()
    machine, source = machine_of(machine_file)
    with terminal.progress(Stage.STARTING) as progress:
        written, signals = write_injection(request, machine, progress)
    for text in written.notes:
        terminal.note(text)
    own_machine = ["-m", str(machine_file)] if machine_file is not None else []
    words = ["mfhca", "diagnose", str(request.output), *own_machine]
    if json:
        terminal.show_json(
            {
                "log": str(written.log),
                "truth": str(written.truth_file),
                "format": written.format,
                "machine": {"name": machine.name, "source": source},
                "open_loop": True,
                "signals": list(signals.items),
                "faults": [asdict(interval) for interval in written.truth.intervals],
                "diagnose": words,
            }
        )
    else:
        _show(terminal, written, signals, words)


def _show(terminal: Terminal, written: MadeLog, signals: Signals, words: list[str]) -> None:
    from cli.tables.layout import key_values, section, table

    rows = [
        (i.component, i.side, i.mode, f"{i.start_s:g} to {i.stop_s:g} s", f"{i.epsilon:.3g}", f"{i.sat_mean:.3g}")
        for i in written.truth.intervals
    ]
    what = f"{written.format}, {len(signals.items)} signals, open-loop; other channels are not written"
    terminal.show(
        section("Injected faults"),
        table(["part", "side", "mode", "time", "ε", "sat"], rows, right=(4, 5)),
        "",
        key_values(
            [("log", f"{written.log}  ({what})"), ("truth", str(written.truth_file)), ("next", shlex.join(words))]
        ),
    )
