"""What `mfhca diagnose --clips` says about its clips."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.tables.clips import show_clips
from cli.terminal.console import Terminal
from diagnosis.clips.write import Clips


def test_clips_are_counted_and_what_is_left_out_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [tmp_path / f"F{i} [x].mcap" for i in (1, 2)]
    for path in paths:
        path.write_bytes(bytes(750_000))
    show_clips(Terminal(), Clips(tuple(paths), 7, ("drive.bag: as it is.",)), Path("out/clips"))
    seen = capsys.readouterr()
    assert seen.out == "Clips: 2 in out/clips (1.5 MB), each with layouts for Foxglove and PlotJuggler\n"
    assert seen.err == (
        "note: 7 more faults have no clip: the 2 most severe ones were cut out\nnote: drive.bag: as it is.\n"
    )


def test_no_fault_to_cut_out_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    show_clips(Terminal(), Clips((), 0, ()), Path("out/clips"))
    assert "no fault of at least low severity" in capsys.readouterr().out
