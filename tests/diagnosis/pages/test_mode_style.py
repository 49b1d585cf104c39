"""Colours of modes: every row of the table is visible on light and dark pages."""

from __future__ import annotations

import re

import pytest

from diagnosis.pages.environment import DARK, SHARED, shared_style
from diagnosis.pages.mode_style import contrast, mode_style
from diagnosis.pages.svg import icon
from diagnosis.results.fault_rows import LOOKS
from replay.faults import FaultMode, State


def variables(block: str) -> dict[str, str]:
    return dict(re.findall(r"--([\w-]+): ([^;]+);", block))


LIGHT = variables(
    shared_style().partition("[data-theme=dark]")[0] + (SHARED / "style.css").read_text().partition("}")[0]
)
BOTH_DARK = variables(" ".join(DARK.findall(shared_style())))


@pytest.mark.parametrize("mode", FaultMode)
def test_every_mode_has_a_colour_and_readable_letters_on_both_pages(mode: FaultMode) -> None:
    look = LOOKS[mode]
    for found, colour in ((LIGHT, look.light), (BOTH_DARK, look.dark)):
        assert found[mode] == colour
        assert contrast(colour, found[f"on-{mode}"]) >= 4.5
        assert contrast(found[f"{mode}-line"], found["surface"]) >= 3.0
    assert f".ln.{mode} {{" in mode_style()


def test_every_mode_has_a_symbol_of_its_own() -> None:
    shapes = {str(icon(m)).replace(m, "") for m in (*FaultMode, State.HEALTHY)}
    assert len(shapes) == len(FaultMode) + 1


def test_contrast() -> None:
    assert contrast("#fff", "#000000") == pytest.approx(21.0)
    assert contrast("#777", "#777777") == 1.0
