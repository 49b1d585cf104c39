"""The timeline and the replayed loop as named columns of one length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.envelope import envelope, rows_of, step_of
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64] | NDArray[np.float32]

# Leaf of the column name and field of `Replay`; shown in reports, and for the export alone.
_WHEEL = (
    ("v_ref", "v_ref"),
    ("e", "e"),
    ("psi_printed", "psi_printed"),
    ("psi_implied", "psi_implied"),
    ("rho", "rho"),
    ("u", "u"),
    ("u_difference", "u_difference"),
)
_WHEEL_DETAIL = (
    ("phi", "wheel_phi"),
    ("psi", "psi"),
    ("psi_implied_squared", "implied_squared"),
    ("psi_forcing", "forcing"),
)
_AT_FULL_RATE = ("v_ref", "phi_ref", "steer_u")
_AXLE = (("phi_ref", "phi_ref"), ("u", "steer_u"), ("u_difference", "steer_difference"))


def replay_columns(timeline: Timeline, replay: Replay, machine: Machine, *, detail: bool = False) -> dict[str, Array]:
    """Name the recorded signals and the replayed loop.

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
        is no sample. A replayed quantity that is nowhere defined has no column.
    """
    bucket = replay.bucket
    columns = {"t": np.arange(rows_of(timeline.size, bucket)) * (timeline.dt * step_of(bucket))}
    names = (*machine.canonical_signals(), *timeline.signals)
    columns |= {n: envelope(timeline.signals[n], bucket) for n in dict.fromkeys(names) if n in timeline.signals}
    for parts, leaves in ((machine.wheels, _WHEEL + (_WHEEL_DETAIL if detail else ())), (machine.axles, _AXLE)):
        for i, part in enumerate(parts):
            for leaf, field in leaves:
                values = getattr(replay, field)[:, i]
                if field in _AT_FULL_RATE:
                    values = envelope(values, bucket)
                if np.isfinite(values).any():
                    columns[f"replay.{part}.{leaf}"] = values
    return columns
