"""The timeline and the replayed loop as named columns of one length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.envelope import envelope, rows_of, step_of
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.machine.quantities import OPENING
from replay.signals.timeline import Timeline

Array = NDArray[np.float64] | NDArray[np.float32]


class Replayed(NamedTuple):
    """A quantity of the replayed loop.

    Attributes
    ----------
    leaf, field : str
        Last word of its column's name, and field of `Replay`.
    unit : str
        To follow a number in a report.
    full_rate : bool
        Whether the field has one row per step, not one per bucket.
    """

    leaf: str
    field: str
    unit: str
    full_rate: bool = False


# Of a wheel: shown in reports, and for the export alone.
_WHEEL = (
    Replayed("v_ref", "v_ref", "m/s", full_rate=True),
    Replayed("e", "e", "m/s"),
    Replayed("psi_printed", "psi_printed", "1"),
    Replayed("psi_implied", "psi_implied", "1"),
    Replayed("rho", "rho", "1/s"),
    Replayed("u", "u", OPENING),
    Replayed("u_difference", "u_difference", OPENING),
)
_WHEEL_DETAIL = (
    Replayed("phi", "wheel_phi", "rad"),
    Replayed("psi", "psi", "1"),
    Replayed("psi_implied_squared", "implied_squared", "1"),
    Replayed("psi_forcing", "forcing", "1"),
)
_OF_FREE_WHEELS = (*_WHEEL[:2], _WHEEL_DETAIL[0])  # without a drive, there is no law of it
_AXLE = (
    Replayed("phi_ref", "phi_ref", "rad", full_rate=True),
    Replayed("u", "steer_u", OPENING, full_rate=True),
    Replayed("u_difference", "steer_difference", OPENING),
)
_UNITS = {quantity.leaf: quantity.unit for quantity in (*_WHEEL, *_WHEEL_DETAIL, *_AXLE)}


def replayed_unit(leaf: str) -> str | None:
    """Unit of a column ``replay.<part>.<leaf>``; None where there is no such quantity."""
    return _UNITS.get(leaf)


def replay_columns(timeline: Timeline, replay: Replay, machine: Machine, *, detail: bool = False) -> dict[str, Array]:
    """Name the recorded signals and the replayed loop.

    Columns of shape (rows,).

    Parameters
    ----------
    timeline : Timeline
        Aligned signals, n steps.
    replay : Replay
        The loop replayed on it.
    machine : Machine
        Wheels and axles.
    detail : bool
        Whether to add each wheel's angle, Ψ̂ of the mode in use, implied Ψ̂² and its forcing.

    Returns
    -------
    dict[str, NDArray[np.float64]], each of the rows of `replay.arrays.envelope` for the replay's bucket
        ``t`` [s], then signals under their canonical names, then ``replay.<part>.<quantity>``; SI, NaN where there
        is no sample. A replayed quantity that is nowhere defined has no column, nor has the steering command of a law that the machine does
        not have (law ``none``).
    """
    bucket = replay.bucket
    columns = {"t": np.arange(rows_of(timeline.size, bucket)) * (timeline.dt * step_of(bucket))}
    names = (*machine.canonical_signals(), *timeline.signals)
    columns |= {n: envelope(timeline.signals[n], bucket) for n in dict.fromkeys(names) if n in timeline.signals}
    steering = tuple(q for q in _AXLE if machine.control.law != "none" or q.leaf == "phi_ref")
    for parts, quantities in ((machine.wheels, _WHEEL + (_WHEEL_DETAIL if detail else ())), (machine.axles, steering)):
        for i, part in enumerate(parts):
            free = part in machine.unpowered
            for quantity in (q for q in quantities if not free or q in _OF_FREE_WHEELS):
                values = getattr(replay, quantity.field)[:, i]
                if quantity.full_rate:
                    values = envelope(values, bucket)
                if np.isfinite(values).any():
                    columns[f"replay.{part}.{quantity.leaf}"] = values
    return columns
