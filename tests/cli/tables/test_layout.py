"""Lines of the terminal do not end between a number and its unit."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from cli.tables.layout import Sentence, bullets, paragraph, table, text

WORDS = "the speed of RL per opening is 38 % below the other wheels' at 40.0–43.0 s, and 2.5 m/s at 20 Hz"


@pytest.mark.parametrize("width", range(18, 60))
def test_a_number_stays_on_its_units_line(width: int) -> None:
    console = Console(width=width, file=io.StringIO(), color_system=None, record=True)
    action = table(["", "do"], [["1", Sentence.assemble(text("Stop", "bold"), text(f": {WORDS}"))]])
    console.print(paragraph(WORDS, "bold"), bullets([WORDS]), action)
    lines = [line.strip() for line in console.export_text().splitlines()]
    assert not [line for line in lines if line.startswith(("%", "s", "m/s", "Hz")) and not line.startswith("speed")]
    assert " ".join(" ".join(lines).replace("•", "").split()).count(WORDS) == 3
