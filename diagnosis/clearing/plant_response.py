"""Speed per opening of each wheel against the machine file's [plant]: what all wheels lose alike, no comparison of wheels shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.responses import LAG_S, MOVING, USUAL_TOP, Responses
from diagnosis.estimation.valve_map import effective
from replay.machine.config import WheelPlant

#: Of the loss that counts [ln]: oil, load and supply change what a healthy machine gives by more than wheels differ.
LIMIT = 0.65
#: The same of what all wheels come to lose for a part of the mission, which slopes and loads that last for a while make more of.
PART = 1.2
_OF_IT, _SPLITS, _WHEELS = 0.2, 40, 3  # of the windows, at least; moments that are tried; that must be known at a time
_PAIR = 2  # the same where no more are driven
_SPELL_S, _SHORT = 20.0, 1.25  # in which all lose likewise, and by how many times as much: hills last as long
#: Where what most wheels are off it hardly scatters [ln], the limit of the whole mission holds for parts, and for shorter spells.
_FITS, _BRIEF_S = 0.05, 10.0
_LEAST_WINDOWS = 8
_UNSEEN = 0.1  # of the expected speed, by which the file does not know it
_HELD = 8.0  # times as much does the ground hold a wheel as its own valve drives it: its own map is hardly known, that of all wheels is


class ForAPart(NamedTuple):
    """What most wheels are off their [plant] for a part of the mission [ln], and from where on it counts, as a multiple of the loss that counts."""

    off: float
    limit: float


def beside_plant(cells: Cells, opening: Array, responses: Responses) -> tuple[list[float | None], ForAPart | None]:
    """ln of each wheel's usual speed over what its [plant] gives at the same openings, and what most wheels are off it for a part of the mission.

    None where that is not known.

    Wheels that the ground holds much more than their valves drive them are asked together: a fit of one mission and another shares
    what all of them give between them by chance.

    Parameters
    ----------
    cells : Cells
        The mission.
    opening : Array, shape (cells, wheels)
        Openings, or their commands where they are not measured [of full].
    responses : Responses
        Of the wheels, which say where they are settled.
    """
    plants = cells.machine.plant.wheels
    wheels = list(cells.machine.wheels)
    logs: list[float | None] = [None] * len(wheels)
    sums: dict[int, tuple[float, float]] = {}
    columns: list[Array] = []
    for i, wheel in enumerate(wheels):
        if (plant := plants.get(wheel)) is None:
            continue
        moved, expected = _moved(cells, i, opening[:, i], plant, responses)
        columns.append(_windows(cells, moved, expected, wheel))
        if (plant.grip or 0.0) > _HELD:
            sound = ~cells.told(wheel)
            sums[i] = float(moved[sound].sum()), float(expected[sound].sum())
        else:
            known = columns[-1][np.isfinite(columns[-1])]
            logs[i] = float(np.median(known)) if known.size >= _LEAST_WINDOWS else None
    together = _together(list(sums.values()), cells)
    least = min(_WHEELS, max(_PAIR, len(cells.driven)))
    part = _for_a_part(columns, cells.frame.hop * cells.dt, least)
    return [together if i in sums else log for i, log in enumerate(logs)], part


def _together(sums: Sequence[tuple[float, float]], cells: Cells) -> float | None:
    """ln of the speeds of some wheels over what their [plant] gives, together; None where too little is known."""
    moved, expected = (sum(x) for x in zip(*sums, strict=True)) if sums else (0.0, 0.0)
    least = _LEAST_WINDOWS * cells.frame.hop * MOVING / USUAL_TOP * cells.machine.max_speed
    return float(np.log(moved / expected)) if moved > least and expected > 0.0 else None


def _windows(cells: Cells, moved: Array, expected: Array, wheel: str) -> Array:
    """ln of a wheel's speed over the expected one in windows that are full of both and beside its stated faults, else NaN, shape (windows,)."""
    frame = cells.frame
    full = frame.sums((moved > 0.0).astype(np.float64)) >= 0.5 * frame.length
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(frame.sums(moved) / frame.sums(expected))
    return np.where(full & np.isfinite(log) & ~cells.explained(wheel), log, np.nan)


def _for_a_part(columns: Sequence[Array], hop_s: float, wheels: int) -> ForAPart | None:
    """Largest median of what most wheels are off before, or from, any moment on, or for a spell.

    None of fewer than so many wheels known at a time, or of few windows, one every `hop_s`.
    """
    if len(columns) < wheels:
        return None
    every = np.column_stack(columns)
    every = every[np.isfinite(every).sum(axis=1) >= wheels]
    least = max(_LEAST_WINDOWS, round(_OF_IT * len(every)))
    if len(every) < 2 * least:
        return None
    most = np.nanmedian(every, axis=1)
    splits = range(least, len(most) - least + 1, max(1, len(most) // _SPLITS))
    sides = max(max(abs(float(np.median(most[:k]))), abs(float(np.median(most[k:])))) for k in splits)
    if float(np.median(np.abs(most - np.median(most)))) <= _FITS:
        two = np.sort(np.where(np.isfinite(every), every, np.inf), axis=1)[
            :, 1
        ]  # what two wheels lose at least, of an axle or a side
        brief = round(_BRIEF_S / hop_s)
        return ForAPart(max(sides, _spell(most, brief), _spell(np.minimum(two, 0.0), brief)), LIMIT)
    return ForAPart(max(sides, _spell(most, round(_SPELL_S / hop_s)) / _SHORT), PART)


def _spell(off: Array, length: int) -> float:
    """Largest median over so many values on end, 0 of fewer."""
    if off.size < length:
        return 0.0
    return float(np.abs(np.median(np.lib.stride_tricks.sliding_window_view(off, length), axis=1)).max())


def _moved(cells: Cells, i: int, opening: Array, plant: WheelPlant, responses: Responses) -> tuple[Array, Array]:
    """A wheel's speed, and what its [plant] gives at the same openings, where both are known and it is settled, else 0 [m/s], shape (cells,)."""
    given, unseen, _ = effective(opening, plant)
    lag = max(plant.tau / (1.0 + (plant.grip or 0.0)), LAG_S)  # the ground makes a wheel quicker
    passed = lowest_passed(plant.K * given, cells.dt, lag)
    known = np.isfinite(opening) & (unseen * plant.K <= _UNSEEN * np.abs(passed))
    moved = responses.weight[:, i] * known
    return moved, np.where(moved > 0.0, np.abs(passed), 0.0)
