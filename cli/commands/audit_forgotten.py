"""`mfhca audit --forget`: logs that were not judged, are no longer there, and are left out from now on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from cli.terminal.console import Terminal
from replay.errors import ConfigError
from replay.progress import Stage

if TYPE_CHECKING:
    from diagnosis.audit.events import EventFacts


def run_forget(terminal: Terminal, output: Path, names: Sequence[str], paths: Sequence[str], *, json: bool) -> None:
    """Leave missions out, and show the machines as the fleet page has them afterwards.

    Raises
    ------
    ConfigError
        Where logs are given too, or a mission cannot be left out.
    """
    if paths:
        raise ConfigError(f"--forget: audits nothing; leave out {paths[0]}, and audit it afterwards")
    with terminal.progress(Stage.WRITING):
        from diagnosis.audit.forgetting import forget_missions

        machines = forget_missions(output, names, _unheard)
    if json:
        terminal.show_json({"forgotten": list(names), "machines": [asdict(m) for m in machines]})
        return
    from cli.tables.audit import machine_parts
    from cli.tables.layout import text

    for name in names:
        terminal.show(text(f"Left out: {name}"))
    terminal.show(*machine_parts(machines), "", text(f"fleet page  {output / 'fleet.html'}"))


def _unheard(event: str, facts: EventFacts) -> None:
    """Take an event that nobody asked for."""
