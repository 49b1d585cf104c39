"""What a mission would have shown of each part: the checks of the all-clear, asked about faults that are not there.

A fault of a size and length is laid at many places of the mission; it is found where it would have brought a check beyond its
limit. The smallest size that is found at 95 % of the places is what the mission shows.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.gauges import Gauges, gauges_of
from diagnosis.clearing.placements import Placements, placements
from diagnosis.results.detectability import Detectability, Detectable, Deviation, Powers, Trace
from diagnosis.results.vocabulary import Kind
from replay.arrays.quantiles import quantile_of
from replay.faults import Side

LENGTHS_S = (2.0, 10.0, None)
_TRACED_S = 10.0
_SURE = 0.95
#: Of sizes, by kind and length, so that 95 of 100 are found, not fewer and not many more: loops hide some of a fault, and checks
#: that have no size of their own see some of it. From tuning seeds.
_MARGIN: Mapping[Kind, Mapping[float | None, float]] = {
    Kind.WHEEL: {2.0: 1.0, 10.0: 1.02, None: 1.08},
    Kind.STEER: {2.0: 1.2, 10.0: 1.2, None: 1.35},
}
_NOISE_MARGIN: Mapping[float | None, float] = {
    2.0: 0.8,
    10.0: 0.8,
    None: 1.0,
}  # loops answer to noise, and make it larger
_STEERED_S = 0.5  # of a fault of a steering axle, which mostly rests


def detectable(cells: Cells, powers: Mapping[tuple[str, str], Powers] | None = None) -> Detectability:
    """Rows and traces of all parts that the log shows.

    Parameters
    ----------
    cells : Cells
        The mission.
    powers : Mapping[tuple[str, str], Powers] or None
        What families say themselves of parts that they have judged, by component and side.
    """
    own = powers or {}
    rows: list[Detectable] = []
    traces: list[Trace] = []
    clear_at = cells.machine.limits.clear_at
    with warnings.catch_warnings(), np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)  # windows without any value
        for gauges in gauges_of(cells):
            if (gauges.component, gauges.side.value) not in own:
                found, trace = _rows(gauges, cells, clear_at)
                rows += found
                traces.append(trace)
    for (component, side), said in own.items():
        about = (Kind.WHEEL, component, Side(side))
        rows += [
            Detectable(*about, p.deviation, p.for_s, p.size, p.unit, p.share, p.places, said.told) for p in said.rows
        ]
        if said.start_s:
            traces.append(Trace(*about, said.start_s, said.loss))
    rows.sort(key=lambda row: _place(cells, row.component))
    traces.sort(key=lambda trace: _place(cells, trace.component))
    return Detectability(tuple(rows), tuple(traces))


def _place(cells: Cells, component: str) -> int:
    """Place of a component among the machine's."""
    return [*cells.machine.wheels, *cells.machine.axles].index(component)


def _rows(g: Gauges, cells: Cells, clear_at: float) -> tuple[list[Detectable], Trace]:
    """Rows of a side, and its trace: the losses of one of the lengths, by place."""
    placed = {length: places_of(g, cells, length) for length in LENGTHS_S}
    losses = {length: g.sizes(places, lambda r: r.loss, lambda r: r.loss) for length, places in placed.items()}
    rows = list(_rows_of(g, placed, losses, clear_at))
    return rows, _trace(g, placed[_TRACED_S], losses[_TRACED_S], cells.dt)


def _rows_of(
    g: Gauges, placed: Mapping[float | None, Placements], losses: Mapping[float | None, Array], clear_at: float
) -> Iterator[Detectable]:
    for length, places in placed.items():
        loss = losses[length]
        excess = g.excesses(places)
        if length is None:
            loss = np.minimum(loss, g.lasting.get(Deviation.INEFFICIENT, np.inf))
            excess = np.minimum(excess, g.lasting.get(Deviation.EXCESS, np.inf))
        yield _row(g, Deviation.INEFFICIENT, length, np.where(loss <= 1.0, loss, np.inf), "1", clear_at)
        dead = loss <= 1.0
        if g.still is not None:
            dead |= g.still.shows(places.overlap(g.still.frame))
        yield _row(g, Deviation.NO_SIGNAL, length, np.where(dead, 1.0, np.inf), "", 1.0)
        if length is not None:
            yield _row(g, Deviation.STUCK, length, np.where(g.held(places), 1.0, np.inf), "", 1.0)
        yield _row(g, Deviation.EXCESS, length, excess, "1", clear_at)
        if g.side is Side.SENSOR:
            offset = g.offsets(places)
            if length is None:
                offset = np.minimum(offset, g.lasting.get(Deviation.OFFSET, np.inf))
            yield _row(g, Deviation.OFFSET, length, offset, g.unit, None)
        if g.rough is not None:
            noise = g.rough.noise(places.overlap(g.rough.frame))
            yield _row(g, Deviation.NOISY, length, noise, g.unit, None)
    if (delay := g.lasting.get(Deviation.DELAY)) is not None:
        yield _row(g, Deviation.DELAY, None, np.array([delay]), "s", None)


def places_of(g: Gauges, cells: Cells, length: float | None) -> Placements:
    """Where a fault of a length [s], None for the whole mission, is laid."""
    enough = g.moving.size if g.kind is Kind.WHEEL else round(_STEERED_S / cells.dt)
    return placements(g.moving, None if length is None else round(length / cells.dt), enough)


def _row(
    g: Gauges, deviation: Deviation, length: float | None, sizes: Array, unit: str, natural: float | None
) -> Detectable:
    if unit:
        sizes = (_NOISE_MARGIN if deviation is Deviation.NOISY else _MARGIN[g.kind])[length] * sizes
    size = float(quantile_of(sizes, _SURE, method="higher")) if sizes.size else np.inf
    if unit == "1" and deviation is Deviation.INEFFICIENT and size > 1.0:
        size = np.inf
    share = None if natural is None or not sizes.size else float(np.mean(sizes <= natural))
    known = size if np.isfinite(size) else None
    return Detectable(g.kind, g.component, g.side, deviation, length, known, unit, share, sizes.size, g.told)


def _trace(g: Gauges, places: Placements, loss: Array, dt: float) -> Trace:
    return Trace(
        g.kind,
        g.component,
        g.side,
        tuple(float(x) for x in places.first * dt),
        tuple(float(x) if x <= 1.0 else None for x in loss),
    )
