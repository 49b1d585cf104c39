"""`mfhca diagnose --clips`: what is written, in words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cli.tables.layout import text
from cli.terminal.console import Terminal

if TYPE_CHECKING:
    from diagnosis.clips.write import Clips

FOLDER = "clips"


def show_clips(terminal: Terminal, clips: Clips, folder: Path) -> None:
    """Say how many clips stand where, and what they leave out."""
    count = len(clips.paths)
    if not count:
        terminal.show(text("Clips: no fault of at least low severity to cut out"))
        return
    size = sum(path.stat().st_size for path in clips.paths) / 1e6
    terminal.show(text(f"Clips: {count} in {folder} ({size:.3g} MB), each with layouts for Foxglove and PlotJuggler"))
    if clips.left_out:
        terminal.note(f"{clips.left_out} more faults have no clip: the {count} most severe ones were cut out")
    for note in clips.notes:
        terminal.note(note)
