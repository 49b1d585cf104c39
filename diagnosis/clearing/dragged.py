"""Wheels that the model alone calls faulty while another one turns against its command: that one holds them back, or pulls them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Cells
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import not_worth_a_check
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Tier
from replay.faults import Side

_ASKED, _TURNS = 0.1, 0.02  # of the top speed: a command to drive, and a wheel that turns
_MOSTLY = 0.5  # of a finding's time
_AGAINST = "Meanwhile another {wheel} turns against its command: it holds this one back, or pulls it, which makes the fault less probable."
Part = tuple[str, str]


def less_sure_beside_backwards(
    assessments: Mapping[Part, Assessment], cells: Cells, words: MachineWords
) -> dict[Part, Assessment]:
    """Assessments in which what only a model shows of wheels' valves is not worth a check while another wheel turns against its command.

    Not of wheels that turn against their own.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    cells : Cells
        The mission.
    words : MachineWords
        How to speak of the machine.
    """
    doubtful = [
        part for part, a in assessments.items() if any(map(_doubtful, a.findings)) and part[0] in cells.machine.wheels
    ]
    out = dict(assessments)
    if not doubtful:
        return out
    against = against_their_commands(cells)
    for part in doubtful:
        own = against[:, cells.machine.wheels.index(part[0])]
        other = against.any(axis=1) & ~own
        found = assessments[part].findings
        less = [_doubtful(f) and _mostly(other, f, cells.width) for f in found]
        if any(less):
            told = (not_worth_a_check(f, words.fill(_AGAINST)) if x else f for f, x in zip(found, less, strict=True))
            out[part] = replace(assessments[part], findings=tuple(told))
    return out


def against_their_commands(cells: Cells) -> NDArray[np.bool_]:
    """Cells in which wheels turn against their commands, shape (cells, wheels)."""
    top, speed, asked = cells.machine.max_speed, cells.wheels("v"), cells.reference
    with np.errstate(invalid="ignore"):
        driven = (np.abs(asked) > _ASKED * top) & (np.abs(speed) > _TURNS * top)
        return np.asarray(driven & (speed * asked < 0.0), dtype=np.bool_)


def _doubtful(f: Finding) -> bool:
    return f.tier is Tier.MODEL and f.side is not Side.SENSOR


def _mostly(other: NDArray[np.bool_], f: Finding, width: int) -> bool:
    part = other[f.start // width : -(-f.stop // width)]
    return part.size > 0 and float(np.mean(part)) > _MOSTLY
