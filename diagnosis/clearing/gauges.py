"""What can be asked of each side of a part: its motion per opening, its second measurement, its quick changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing import axles, valves, wheels, yaw
from diagnosis.clearing import responses as resp
from diagnosis.clearing.alone import Rough, Still, Straight
from diagnosis.clearing.axle_rates import rates_of
from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.limits import measured_twice, response_limits
from diagnosis.clearing.measure import as_followed, compared, late
from diagnosis.clearing.openings import openings_tell
from diagnosis.clearing.placements import Overlap, Placements, Ratio, Reference
from diagnosis.clearing.seconds import alone_apart, off_second
from diagnosis.clearing.still import answered, rate_of, still_frame
from diagnosis.results.detectability import Deviation
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

#: Smallest size at each place.
Sizes = Callable[[Overlap], Array]


@dataclass(frozen=True)
class Gauges:
    """What can be asked of one side of a part.

    Attributes
    ----------
    kind, component, side
        The part.
    unit : str
        Of its channel.
    moving : NDArray[np.bool_], shape (cells,)
        Whether it is driven.
    channel : Array, shape (cells,)
        What it measures, or its opening.
    ratio : Ratio or None
        Its motion per opening.
    reference : Reference or None
        Its second measurement, or the measured opening.
    rough : Rough or None
        Its quick changes.
    still : Still or None
        Whether it rests while it is commanded.
    straight : Straight or None
        Whether it points where the machine goes.
    lasting : dict[Deviation, float]
        Smallest sizes over the whole mission by what is usual of it.
    unpowered : bool
        Whether it is a wheel without a drive.
    """

    kind: Kind
    component: str
    side: Side
    unit: str
    moving: NDArray[np.bool_]
    channel: Array
    ratio: Ratio | None
    reference: Reference | None
    rough: Rough | None = None
    still: Still | None = None
    straight: Straight | None = None
    lasting: dict[Deviation, float] = field(default_factory=dict)
    unpowered: bool = False

    @property
    def told(self) -> Side:
        """The side that the checks name."""
        return self.side if self.reference is not None or self.unpowered else Side.SENSOR_OR_ACTUATOR

    @property
    def _jumps(self) -> bool:
        """Whether a fault's beginning and end are motion of their own: an angle that is scaled jumps."""
        return self.kind is Kind.STEER and self.side is Side.SENSOR

    def excesses(self, places: Placements) -> Array:
        """`sizes` of an excess; an axle that turns faster for some seconds shows by its second measurements alone.

        Shape (places,) [1].
        """
        alone = replace(self, ratio=None) if self.kind is Kind.STEER else self
        return alone.sizes(places, lambda r: r.excess, lambda r: r.excess)

    def offsets(self, places: Placements) -> Array:
        """`sizes` of an offset; of an angle it is no motion per opening, but one shows where the machine goes straight.

        Shape (places,), in the channel's unit.
        """
        if self.kind is not Kind.STEER:
            return self.sizes(places, lambda r: r.offset, lambda r: r.offset)
        alone = replace(self, ratio=None).sizes(places, lambda r: r.offset, lambda r: r.offset)
        return (
            alone
            if self.straight is None
            else np.minimum(alone, self.straight.offset(places.overlap(self.straight.frame)))
        )

    def sizes(
        self, places: Placements, ratio: Callable[[Ratio], Sizes], reference: Callable[[Reference], Sizes]
    ) -> Array:
        """Smallest size that either shows at each place; infinite where none does. Shape (places,)."""
        out = np.full(places.first.size, np.inf)
        if self.ratio is not None:
            sizes = ratio(self.ratio)(places.overlap(self.ratio.frame, within=self._jumps))
            out = np.minimum(out, sizes)
        if self.reference is not None:
            out = np.minimum(out, reference(self.reference)(places.overlap(self.reference.compared.frame)))
        return out

    def held(self, places: Placements) -> NDArray[np.bool_]:
        """Whether either shows that the channel stays at its last value, shape (places,)."""
        out = np.zeros(places.first.size, dtype=np.bool_)
        if self.ratio is not None:
            over = places.overlap(self.ratio.frame, within=self._jumps)
            shown = self.ratio.shows_hold(over, self.channel, places.first)
            out |= shown
        if self.reference is not None:
            out |= self.reference.shows_hold(places.overlap(self.reference.compared.frame), places.first)
        return out


def gauges_of(cells: Cells) -> Iterator[Gauges]:
    """Of all sides of all parts that the log shows."""
    yield from _wheels(cells)
    yield from _axles(cells)


def _wheels(cells: Cells) -> Iterator[Gauges]:
    speed, command, opening, second = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied", "v_true"))
    clear_at, top = cells.machine.limits.clear_at, cells.machine.max_speed
    used = np.where(np.isfinite(opening), opening, command)
    followed = as_followed(cells, opening, command, valves.OPENING)
    responses = resp.wheel_responses(cells)
    limits = response_limits(
        responses, measured_twice(cells), clear_at, cells.carried_shares, cells.ahead, driven=len(cells.driven)
    )
    tells = openings_tell(cells, responses)
    delays, rough = late(speed, cells.reference, cells.dt), wheels.roughness_of(cells, speed)
    least = valves.beside_commands(cells, Kind.WHEEL).limits
    most_apart = [float(z) for z in resp.largest(off_second(cells, speed, second, wheels.FLOOR * top))]
    for i, name in enumerate(cells.machine.wheels):
        v, u, a, x = (z[:, i] for z in (speed, command, opening, second))
        if not _known(v):
            continue
        twice, measured = _known(a) and _known(u), _known(x)
        motion = np.where(np.isfinite(cells.reference[:, i]), cells.reference[:, i], v)
        moving = (np.abs(motion) > resp.MOVING * top / resp.USUAL_TOP) & ~cells.told(name)
        ratio = None
        lasting: dict[Deviation, float] = {}
        if _known(used[:, i]) and len(cells.driven) >= resp.OTHERS and (tells or not (twice and measured)):
            limit = limits[i]
            off = np.where(cells.explained(name), np.nan, responses.windows[:, i])
            usual, back = responses.usual[i], (~responses.ahead[:, i]).astype(np.intp)
            # of a wheel that is measured twice on both sides, an excess is the ground's doing
            above, lasting_above = (np.inf, np.inf) if twice and measured else (limit.above, limit.lasting_above)
            # where its faults are stated for much of the mission, nothing more is asked of all of it
            told = cells.mostly_explained(name)
            rooms = _rooms(tuple(None if told else x for x in usual.ways), limit.lasting_below, lasting_above)
            ratio = Ratio(cells.frame, off, responses.weight[:, i], limit.below, above, back, rooms)
            if usual.least is not None and usual.most is not None and not told:
                lasting = _lasting(limit.lasting_below + usual.least, lasting_above - usual.most)
        delay = delays[i]
        late_by = {} if delay is None else {Deviation.DELAY: wheels.LATE_S + delay + cells.dt}
        most = alone_apart(most_apart, i, clear_at)
        second_one = _reference(cells, name, (v, x, wheels.FLOOR * top), most) if measured else None
        with np.errstate(
            invalid="ignore"
        ):  # nor does a window show anything that is beyond the limit as it is, which a check need not count
            as_it_is = rough.quick[:, i] >= rough.limit[:, i] * rough.size[:, i]
        quick = np.where(cells.explained(name) | as_it_is, np.nan, rough.quick[:, i])
        own = Rough(cells.frame, quick, rough.size[:, i], rough.limit[:, i], cells.width)
        about = (Kind.WHEEL, name)
        yield Gauges(
            *about,
            Side.SENSOR,
            "m/s",
            moving,
            v,
            ratio,
            second_one,
            own,
            lasting={**lasting, **late_by},
            unpowered=name in cells.machine.unpowered,
        )
        if twice:
            asked = _reference(cells, name, (a, followed[:, i], valves.OPENING), least[i])
            yield Gauges(*about, Side.ACTUATOR, "1", moving, a, None, asked)
        elif _known(u):
            yield Gauges(*about, Side.ACTUATOR, "1", moving, v, ratio, None, lasting=lasting)


def _axles(cells: Cells) -> Iterator[Gauges]:
    angle, second, command, opening = (cells.axles(leaf) for leaf in ("phi", "phi_true", "u", "u_applied"))
    clear_at, frame = cells.machine.limits.clear_at, still_frame(cells)
    used, share = np.where(np.isfinite(opening), opening, command), -np.log1p(-clear_at)
    followed = as_followed(cells, opening, command, valves.OPENING)
    rates, limit = rates_of(cells, rate_of(angle, cells.dt), used), answered(cells)
    path = yaw.off_straight(cells)
    straight = None if path is None else Straight(cells.frame, path, yaw.OFF / yaw.ANSWERED)
    turned = (
        {} if path is None else {Deviation.OFFSET: (yaw.LASTING_OFF + abs(float(np.nanmedian(path)))) / yaw.ANSWERED}
    )
    least = valves.beside_commands(cells, Kind.STEER).limits
    for j, name in enumerate(cells.machine.axles):
        phi, x, u, a = (z[:, j] for z in (angle, second, command, opening))
        if not _known(phi):
            continue
        twice, measured = _known(a) and _known(u), _known(x)
        moving = (rates.weight[:, j] != 0.0) & ~cells.told(name)
        ratio = None
        lasting: dict[Deviation, float] = {}
        if _known(used[:, j]):
            brief = axles.brief_limit(rates, j, share)
            long = axles.RATE[1] * share
            off = np.where(cells.explained(name, rates.frame), np.nan, rates.off[:, j])
            ratio = Ratio(
                rates.frame,
                off,
                rates.weight[:, j],
                brief,
                brief,
                np.zeros(len(off), dtype=np.intp),
                ((np.inf, np.inf),),
            )
            if rates.ahead[j] and not cells.mostly_explained(name):  # what the check of the mission compares
                lasting = _lasting(long + min(rates.ahead[j]), long - max(rates.ahead[j]))
        still = Still(frame, np.abs(frame.mean(u)) >= limit) if _known(u) else None
        second_one = _reference(cells, name, (phi, x, axles.FLOOR_RAD), clear_at) if measured else None
        about = (Kind.STEER, name)
        yield Gauges(
            *about, Side.SENSOR, "rad", moving, phi, ratio, second_one, None, still, straight, {**lasting, **turned}
        )
        if twice:
            asked = _reference(cells, name, (a, followed[:, j], valves.OPENING), least[j])
            yield Gauges(*about, Side.ACTUATOR, "1", moving, a, None, asked, still=still)
        elif _known(u):
            yield Gauges(*about, Side.ACTUATOR, "1", moving, phi, ratio, None, still=still, lasting=lasting)


def _rooms(usual: tuple[float | None, ...], below: float, above: float) -> tuple[tuple[float, float], ...]:
    """How far usual ones [ln] are from their limits; infinite where they are not known."""
    return tuple((np.inf, np.inf) if x is None else (below + x, above - x) for x in usual)


def _lasting(below: float, above: float) -> dict[Deviation, float]:
    """Smallest loss and excess over the mission, by what is left to their limits [ln]."""
    loss = {Deviation.INEFFICIENT: max(0.0, float(-np.expm1(-below)))}
    return loss | ({Deviation.EXCESS: max(0.0, float(np.expm1(above)))} if np.isfinite(above) else {})


def _reference(cells: Cells, component: str, pair: tuple[Array, Array, float], limit: float) -> Reference:
    """A channel, its reference and its floor; nothing where a fault is stated.

    Nor does a window show anything that is beyond the limit as it is, by a lag of its own or a moment that the check does not count:
    it would show a fault of no size.
    """
    found = compared(cells, *pair)
    with np.errstate(invalid="ignore"):
        as_it_is = found.off >= limit
    return Reference(found._replace(moves=found.moves & ~cells.explained(component) & ~as_it_is), limit)


def _known(x: Array) -> bool:
    return bool(np.isfinite(x).any())
