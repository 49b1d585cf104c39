"""Kinds of trouble of `all_clear.py`: what may be wrong with a machine, its recorder or its machine file.

Every fault here is at least as large as the default of ``[limits] clear_at``: a loss of a quarter, or what deviates as much,
for three seconds of driving. A kind is a part, a form and a time course; its sizes are drawn from a run's own seed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from replay.faults import FaultMode, FaultSpec, Side
from replay.signals.signal import Signals

Courses = tuple[tuple[float, float], ...]
#: A part with a fault: component and side.
Part = tuple[str, str]


@dataclass(frozen=True)
class Form:
    """What a fault makes of a part; see `FaultSpec`."""

    name: str
    mode: FaultMode
    epsilon: float = 1.0
    sat: float = 0.0
    sat_std: float = 0.0
    sat_tau_s: float = 0.0
    ramp: bool = False


@dataclass(frozen=True)
class Trouble:
    """One kind.

    Attributes
    ----------
    name : str
        ``FR valve dead, whole``.
    faults : tuple[FaultSpec, ...]
        In the simulated machine.
    edit : Callable or None
        What happens to the recorded signals.
    parts : frozenset[Part]
        Parts that are faulty, any of which is right to name; empty: no part is.
    """

    name: str
    faults: tuple[FaultSpec, ...] = ()
    edit: Callable[[Signals], Signals] | None = None
    parts: frozenset[Part] = frozenset()


_M = FaultMode
VALVE = (
    Form("dead", _M.NO_SIGNAL),
    Form("stuck .06", _M.STUCK, sat=0.06),
    Form("stuck -.1", _M.STUCK, sat=-0.1),
    Form("stuck .3", _M.STUCK, sat=0.3),
    Form("loses .3", _M.INEFFICIENT, 0.3),
    Form("loses .5", _M.INEFFICIENT, 0.5),
    Form("loses .8", _M.INEFFICIENT, 0.8),
    Form("biased .12", _M.OUTSIDE_TABLE, 0.02, sat=6.0),
    Form("disturbed", _M.NOISY, 0.4, sat=0.08, sat_std=0.08, sat_tau_s=0.8),
    Form("fades to .6", _M.INEFFICIENT, 0.6, ramp=True),
)
SENSOR = (
    Form("dead", _M.NO_SIGNAL),
    Form("held", _M.STUCK, sat=math.nan),
    Form("stuck .1", _M.STUCK, sat=0.1),
    Form("loses .3", _M.INEFFICIENT, 0.3),
    Form("loses .6", _M.INEFFICIENT, 0.6),
    Form("reads 1.35", _M.OUTSIDE_TABLE, -0.35),
    Form("offset .08", _M.OUTSIDE_TABLE, 0.01, sat=8.0),
    Form("noisy .12", _M.NOISY, 0.4, sat=0.05, sat_std=0.12, sat_tau_s=0.05),
    Form("white noise", _M.NOISY, 0.3, sat=0.0, sat_std=0.25),
    Form("fades to .6", _M.INEFFICIENT, 0.6, ramp=True),
)
STEERING_VALVE = (
    Form("dead", _M.NO_SIGNAL),
    Form("stuck .1", _M.STUCK, sat=0.1),
    Form("loses .5", _M.INEFFICIENT, 0.5),
    Form("loses .8", _M.INEFFICIENT, 0.8),
    Form("biased .1", _M.OUTSIDE_TABLE, 0.02, sat=5.0),
)
STEERING_SENSOR = (
    Form("dead", _M.NO_SIGNAL),
    Form("held", _M.STUCK, sat=math.nan),
    Form("loses .4", _M.INEFFICIENT, 0.4),
    Form("offset .15", _M.OUTSIDE_TABLE, 0.02, sat=7.5),
    Form("noisy .2", _M.NOISY, 0.4, sat=0.0, sat_std=0.25, sat_tau_s=0.05),
)


def courses(duration: float) -> Mapping[str, Courses]:
    """When a fault is there: spans of a mission."""
    return {
        "whole": ((0.0, duration),),
        "first third": ((0.0, duration / 3),),
        "last half": ((duration / 2, duration),),
        "12 s": ((0.45 * duration, 0.45 * duration + 12.0),),
        "five times 3 s": tuple((s * duration, s * duration + 3.0) for s in (0.15, 0.3, 0.45, 0.6, 0.75)),
    }


def faults_of(component: str, side: Side, form: Form, spans: Courses) -> tuple[FaultSpec, ...]:
    """One form on one part, at its times."""
    return tuple(
        FaultSpec(
            component, side, form.mode, a, b, form.epsilon, form.sat, form.sat_std, form.sat_tau_s, (b - a) * form.ramp
        )
        for a, b in spans
    )


def _single(duration: float) -> Iterator[Trouble]:
    """One part."""
    wheels, axles = ("FR", "FL", "RR", "RL"), ("front", "rear")
    kinds = (
        (wheels, Side.ACTUATOR, "valve", VALVE),
        (wheels, Side.SENSOR, "sensor", SENSOR),
        (axles, Side.ACTUATOR, "steering valve", STEERING_VALVE),
        (axles, Side.SENSOR, "steering sensor", STEERING_SENSOR),
    )
    k = 0
    for components, side, words, forms in kinds:
        for form in forms:
            for course, spans in courses(duration).items():
                component = components[k % len(components)]
                k += 1
                yield Trouble(
                    f"{component} {words} {form.name}, {course}",
                    faults_of(component, side, form, spans),
                    parts=frozenset({(component, side.value)}),
                )


def _several(duration: float) -> Iterator[Trouble]:
    """Several parts at once."""
    s, a = Side.SENSOR, Side.ACTUATOR
    loss, half, dead = SENSOR[3], VALVE[5], VALVE[0]
    sets: dict[str, tuple[tuple[str, Side, Form], ...]] = {
        "RL sensor and its valve lose": (("RL", s, loss), ("RL", a, half)),
        "FR sensor reads too much, its valve loses": (("FR", s, SENSOR[5]), ("FR", a, half)),
        "both front valves lose half": (("FR", a, half), ("FL", a, half)),
        "right valves dead": (("FR", a, dead), ("RR", a, dead)),
        "three valves lose half": (("FR", a, half), ("FL", a, half), ("RR", a, half)),
        "FL sensor dead, RR valve dead": (("FL", s, dead), ("RR", a, dead)),
        "two sensors lose": (("FL", s, loss), ("RR", s, loss)),
        "both steering valves dead": (("front", a, dead), ("rear", a, dead)),
        "both steering sensors dead": (("front", s, dead), ("rear", s, dead)),
        "steering valve dead, wheel valve dead": (("rear", a, dead), ("RL", a, dead)),
    }
    for words, parts in sets.items():
        for course in ("whole", "first third", "12 s"):
            spans = courses(duration)[course]
            faults = tuple(f for c, side, form in parts for f in faults_of(c, side, form, spans))
            yield Trouble(f"{words}, {course}", faults, parts=frozenset((c, side.value) for c, side, _ in parts))


def _late(name: str, seconds: float) -> Callable[[Signals], Signals]:
    """A channel that is late."""

    def edit(signals: Signals) -> Signals:
        one = signals.items[name]
        return replace(signals, items={**signals.items, name: replace(one, stamps=one.stamps + round(seconds * 1e9))})

    return edit


def _changed(name: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Signals], Signals]:
    """A channel with other values; `change` gets seconds and values."""

    def edit(signals: Signals) -> Signals:
        one = signals.items[name]
        seconds = (one.stamps - one.stamps[0]) * 1e-9
        return replace(signals, items={**signals.items, name: replace(one, values=change(seconds, one.values))})

    return edit


def _spiky(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    out, rng = values.copy(), np.random.default_rng(3)
    at = rng.random(values.size) < 0.03
    out[at] += 0.3 * rng.choice((-1.0, 1.0), np.count_nonzero(at))
    return out


def _recorded(duration: float) -> Iterator[Trouble]:
    """Sensors and recorders: late, drifting, spiky, ending."""
    part = frozenset({("RR", "sensor")})
    drift = _changed("wheel.RR.v", lambda t, y: y + 0.12 * t / duration)
    yield Trouble("RR sensor late by .4 s", edit=_late("wheel.RR.v", 0.4), parts=part)
    yield Trouble("RR sensor drifts", edit=drift, parts=part)
    yield Trouble("RR sensor with spikes", edit=_changed("wheel.RR.v", _spiky), parts=part)
    yield Trouble("RR sensor of the wrong sign", edit=_changed("wheel.RR.v", lambda t, y: -y), parts=part)
    ends = _changed("wheel.RR.v", lambda t, y: np.where(t > 0.6 * duration, np.nan, y))
    yield Trouble("RR sensor ends", edit=ends, parts=part)
    turned = _changed("steer.front.phi", lambda t, y: -y)
    yield Trouble("front steering sensor of the wrong sign", edit=turned, parts=frozenset({("front", "sensor")}))
    late = _late("steer.rear.phi", 0.6)
    yield Trouble("rear steering sensor late by .6 s", edit=late, parts=frozenset({("rear", "sensor")}))


def _swapped(a: str, b: str) -> Callable[[Signals], Signals]:
    """Two channels under each other's names, as a machine file may have them."""

    def edit(signals: Signals) -> Signals:
        items = dict(signals.items)
        items[a], items[b] = replace(items[b], name=a), replace(items[a], name=b)
        return replace(signals, items=items)

    return edit


def _misnamed(duration: float) -> Iterator[Trouble]:
    """Machine files that are wrong: swaps, signs, units; no part fails, and none may be cleared."""
    yield Trouble("FR and RL speeds swapped", edit=_swapped("wheel.FR.v", "wheel.RL.v"))
    yield Trouble("FR and FL openings swapped", edit=_swapped("wheel.FR.u", "wheel.FL.u"))
    yield Trouble("steering angles swapped", edit=_swapped("steer.front.phi", "steer.rear.phi"))
    yield Trouble("steering commands swapped", edit=_swapped("steer.front.u", "steer.rear.u"))
    for name, factor in (
        ("wheel.FR.v", 0.5),
        ("wheel.FL.v", 2.0),
        ("wheel.RR.u", 0.5),
        ("wheel.RL.u", -1.0),
        ("steer.front.phi", 0.5),
        ("steer.rear.phi", 1.7),
        ("steer.front.u", -1.0),
        ("steer.rear.u", 2.0),
    ):
        yield Trouble(f"{name} times {factor:g}", edit=_changed(name, _times(factor)))
    ends = _changed("wheel.FL.u", lambda t, y: np.where(t > 0.7 * duration, np.nan, y))
    yield Trouble("FL valve command ends", edit=ends)
    ends = _changed("steer.front.phi", lambda t, y: np.where(t > 0.5 * duration, np.nan, y))
    yield Trouble("front steering sensor ends", edit=ends)


def _times(factor: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    return lambda t, y: factor * y


_GROWING = (
    ("front", Side.ACTUATOR, "steering valve", Form("fades to .4", _M.INEFFICIENT, 0.6, ramp=True)),
    ("rear", Side.SENSOR, "steering sensor", Form("fades to .6", _M.INEFFICIENT, 0.4, ramp=True)),
    ("FL", Side.SENSOR, "sensor", Form("comes to read 1.4", _M.OUTSIDE_TABLE, -0.4, ramp=True)),
    ("RR", Side.ACTUATOR, "valve", Form("comes to open 1.4", _M.OUTSIDE_TABLE, -0.4, ramp=True)),
    ("front", Side.SENSOR, "steering sensor", Form("comes to read 1.4", _M.OUTSIDE_TABLE, -0.4, ramp=True)),
    ("rear", Side.ACTUATOR, "steering valve", Form("comes to be biased by .15", _M.OUTSIDE_TABLE, 0.02, sat=7.5, ramp=True)),
)  # fmt: skip


def _growing(duration: float) -> Iterator[Trouble]:
    """One part that gets worse, slowly."""
    for component, side, words, form in _GROWING:
        for course in ("whole", "last half"):
            faults = faults_of(component, side, form, courses(duration)[course])
            yield Trouble(
                f"{component} {words} {form.name}, {course}", faults, parts=frozenset({(component, side.value)})
            )


def _slow(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Lags by a second."""
    kept = math.exp(-float(np.median(np.diff(seconds))) / 1.0)
    out, state = np.empty_like(values), values[0]
    for k, y in enumerate(values):
        state = kept * state + (1.0 - kept) * y
        out[k] = state
    return out


def _clipped(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Reads no more than half of its largest value."""
    most = 0.5 * float(np.quantile(np.abs(values), 0.99))
    return np.clip(values, -most, most)


def _deaf(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Reads nothing below four tenths of its largest value."""
    return np.where(np.abs(values) < 0.4 * float(np.quantile(np.abs(values), 0.99)), 0.0, values)


def _loose(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A contact that opens for a fifth of a second, five times in three seconds."""
    at = np.random.default_rng(5).random(int(seconds[-1] / 0.2) + 2) < 1 / 3
    return np.where(at[(seconds / 0.2).astype(int)], 0.0, values)


def _held(seconds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Renews its value every 1.2 s."""
    first = np.searchsorted(seconds, np.floor(seconds / 1.2) * 1.2)
    return values[first]


def _behaving(duration: float) -> Iterator[Trouble]:
    """Sensors that deform what they read."""
    forms = (
        ("slow", _slow, ("RR", "rear")),
        ("clipped", _clipped, ("FL", "front")),
        ("deaf to small values", _deaf, ("RL", "rear")),
        ("with a loose contact", _loose, ("FR", "front")),
        ("renewed every 1.2 s", _held, ("RL", "rear")),
    )
    for words, change, parts in forms:
        for part in parts:
            wheel = part not in ("front", "rear")
            name = f"wheel.{part}.v" if wheel else f"steer.{part}.phi"
            about = frozenset({(part, "sensor")})
            yield Trouble(
                f"{part}{'' if wheel else ' steering'} sensor {words}", edit=_changed(name, change), parts=about
            )
    drift = _changed("steer.front.phi", lambda t, y: y + 0.2 * t / duration)
    yield Trouble("front steering sensor drifts", edit=drift, parts=frozenset({("front", "sensor")}))


def _opened(name: str) -> Callable[[Signals], Signals]:
    """A valve that opens as it is told, by its own measurement: what its wheel lacks is behind it."""

    def edit(signals: Signals) -> Signals:
        told, opening = (signals.items.get(f"wheel.{name}.{leaf}") for leaf in ("u", "u_applied"))
        if told is None or opening is None:
            return signals
        values = np.interp(opening.stamps - opening.stamps[0], told.stamps - opening.stamps[0], told.values)
        return replace(signals, items={**signals.items, opening.name: replace(opening, values=values)})

    return edit


def _behind(duration: float) -> Iterator[Trouble]:
    """Motors and brakes behind valves that are sound, where that is measured."""
    forms = (
        ("FR", "motor loses .5", VALVE[5]),
        ("RL", "brake locked", VALVE[0]),
        ("FL", "motor loses .35", replace(VALVE[4], epsilon=0.35)),
    )
    for component, words, form in forms:
        for course in ("whole", "last half", "12 s"):
            faults = faults_of(component, Side.ACTUATOR, form, courses(duration)[course])
            about = frozenset({(component, side.value) for side in (Side.ACTUATOR, Side.SENSOR_OR_ACTUATOR)})
            yield Trouble(f"{component} {words}, {course}", faults, _opened(component), about)


def troubles(duration: float) -> list[Trouble]:
    """All kinds."""
    return [
        *_single(duration), *_several(duration), *_recorded(duration), *_misnamed(duration),
        *_growing(duration), *_behaving(duration), *_behind(duration),
    ]  # fmt: skip
