"""Time series of all worlds under one name each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted
from replay.control.lyapunov import ProofTerms
from replay.counterfactual.world import OtherWorld

Array = NDArray[np.float64]


def world_columns(
    abducted: Abducted, wheels: Sequence[str], worlds: Mapping[str, OtherWorld], proof: ProofTerms | None = None
) -> dict[str, Array]:
    """Columns by name, each of shape (n,): ``t``, what was recorded, and per law speed, reading and command.

    ``wheel.<W>.v_ref | v | read | u | applied | load | faulty`` of the recorded world (``v``: the wheel's speed where known, ``read``:
    what the controller read, ``load``: d̂ as a speed [m/s]); ``<law>.<W>.v | read | u`` of the others, ``self`` for the recorded law
    replayed in the loop. Where MFHCA ran also ``proof.<W>.F | D | V`` and their sum ``proof.V``.
    """
    world = abducted.world
    columns: dict[str, Array] = {"t": np.asarray(np.arange(len(world.y)) * world.dt, np.float64)}
    load = worlds["recorded"].load
    for i, wheel in enumerate(wheels):
        own = (
            ("v_ref", world.v_ref),
            ("v", world.speed),
            ("read", world.y),
            ("u", world.u),
            ("applied", world.opening),
            ("load", load),
        )
        columns.update({f"wheel.{wheel}.{leaf}": x[:, i] for leaf, x in own})
        columns[f"wheel.{wheel}.faulty"] = abducted.faulty[:, i].astype(np.float64)
    for law, other in worlds.items():
        name = "self" if law == "recorded" else law
        for i, wheel in enumerate(wheels):
            columns[f"{name}.{wheel}.v"] = world.speed[:, i] + other.shift[:, i]
            columns[f"{name}.{wheel}.read"] = other.y[:, i]
            columns[f"{name}.{wheel}.u"] = other.u[:, i]
    if proof is not None:
        for i, wheel in enumerate(wheels):
            columns |= {f"proof.{wheel}.{leaf}": getattr(proof, leaf)[:, i] for leaf in ("F", "D", "V")}
        columns["proof.V"] = proof.V.sum(axis=1)
    return columns
