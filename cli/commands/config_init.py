"""A run of `mfhca config init`: a starter to fill in, or a machine file from a log."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cli.terminal.console import Terminal
from diagnosis.api.inputs import mission_paths
from replay.errors import ConfigError
from replay.progress import Stage

if TYPE_CHECKING:
    from replay.setup.draft_notes import Draft
    from replay.setup.preset import Preset

_STDOUT = Path("-")


def starter() -> str:
    """Commented machine file with every key, its unit and default."""
    from importlib import resources

    return resources.files("cli.commands").joinpath("starter.toml").read_text(encoding="utf-8")


def run_init(
    terminal: Terminal, output: Path | None, logs: Sequence[Path], preset: Preset | None, *, force: bool = False
) -> None:
    """Write a machine file, or print it where no file is named; `force` replaces one.

    Raises
    ------
    ConfigError
        Where the file exists.
    LogError
        Where a log cannot be read, or holds no wheel.
    """
    name = None if output is None or output == _STDOUT else output
    if name is not None and name.exists() and not force:
        raise ConfigError(f"{name}: exists and was not changed; give another name, or --force to replace it")
    if not logs and preset is None:
        _give(terminal, name, starter())
        if name is not None:
            terminal.show(f"Wrote {name}; edit it, then run: mfhca config check {name} --log LOG")
        return
    text, draft = _drafted(terminal, mission_paths(logs), preset)
    _give(terminal, name, text)
    if name is None:
        for sentence in (*draft.found, *(f"to be checked: {q}" for q in draft.questions)):
            terminal.note(sentence)
        return
    _show(terminal, draft, name, logs)


def _drafted(terminal: Terminal, paths: Sequence[Path], preset: Preset | None) -> tuple[str, Draft]:
    with terminal.progress(Stage.STARTING) as progress:
        from replay.setup.all_channels import channel_rows
        from replay.setup.draft import draft_machine, preset_draft
        from replay.setup.machine_text import machine_text
        from replay.setup.read import read_everything

        if not paths:
            assert preset is not None
            draft = preset_draft(preset)
            return machine_text(draft, f"preset {preset.value}"), draft
        logs = read_everything(paths, every=False, progress=progress)
        draft = draft_machine(logs, preset)
        return machine_text(draft, ", ".join(p.name for p in paths), channel_rows(logs, draft.machine)), draft


def _give(terminal: Terminal, name: Path | None, text: str) -> None:
    """Write the file, once it can be read back, or print it."""
    from replay.atomic_write import atomic_path
    from replay.machine.toml_file import load_machine

    if name is None:
        terminal.show_file(text)
        return
    with atomic_path(name) as temporary:
        temporary.write_text(text, encoding="utf-8")
        load_machine(temporary)


def _show(terminal: Terminal, draft: Draft, name: Path, logs: Sequence[Path]) -> None:
    """What was found, what is open, and the next command."""
    from cli.tables.layout import bullets, section

    idle = [log for log in logs if str(log) in draft.idle]  # with which a diagnosis would not begin
    logs = [log for log in logs if log not in idle]
    words = " ".join(shlex.quote(str(log)) for log in logs) or "LOG"
    wheels, count = len(draft.machine.wheels), len(draft.machine.signals)
    many = f"{wheels} wheels" if wheels > 1 else "one drive"
    terminal.show(f"Wrote {name}: {many}, {count} signal{'' if count == 1 else 's'}.")
    if draft.found:
        terminal.show(section("Found"), bullets(draft.found))
    if draft.questions:
        terminal.show(section("To be checked in the file"), bullets(draft.questions, "yellow"))
    if idle:
        left = f"Left out below, for none of its channels is used: {', '.join(str(log) for log in idle)}."
        terminal.show(section("Not used"), bullets([left]))
    terminal.show(section("Next"))
    file = shlex.quote(str(name))
    if logs:
        each = " ".join(f"--log {shlex.quote(str(log))}" for log in logs)
        terminal.show_text(f"  mfhca config check {file} {each}\n")
    terminal.show_text(f"  mfhca diagnose {words} -m {file}\n")
