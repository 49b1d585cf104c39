"""The paper's stability proof along the recorded mission, where the law that ran is MFHCA."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted
from diagnosis.counterfactual.document import ProofRow, SpanRow
from replay.arrays.runs import runs_of
from replay.control.loop import Replay
from replay.control.lyapunov import ProofConstants, ProofTerms, proof_terms
from replay.machine.config import Machine

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_S = 0.1  # length of a stretch that is listed
_MOST_SPANS = 200


def proof_of(abducted: Abducted, replay: Replay, machine: Machine) -> ProofTerms | None:
    """Terms of the proof; None where another law ran, which has no Ψ̂."""
    if replay.law is None:
        return None
    world = abducted.world
    plants = [p for p in abducted.fit.plants if p is not None]
    constants = ProofConstants(
        np.array([p.K for p in plants]),
        abducted.plant.tau,
        replay.law.lambda_,
        machine.control.xi,
        machine.control.beta,
    )
    psi = np.nan_to_num(np.asarray(replay.psi)[:, machine.driven_columns])
    return proof_terms(world.speed, world.v_ref, world.u, psi, world.let_valve, constants, world.dt)


def proof_rows(terms: ProofTerms, machine: Machine, dt: float) -> list[ProofRow]:
    """Sizes of the terms, and where the bound does not hold, by wheel. `dt` in s."""
    rows: list[ProofRow] = []
    for i, wheel in enumerate(machine.driven):
        known = np.isfinite(terms.rate[:, i]) & np.isfinite(terms.bound[:, i])
        rows.append(
            {
                "wheel": wheel,
                "F_most": _most(terms.F[:, i]),
                "D_most": _most(terms.D[:, i]),
                "V_most": _most(terms.V[:, i]),
                "known_s": float(np.count_nonzero(known)) * dt,
                "broken_s": float(np.count_nonzero(terms.broken[:, i])) * dt,
                "uncontrolled_s": float(np.count_nonzero(terms.uncontrolled[:, i])) * dt,
                "broken": _spans(terms.broken[:, i], dt),
            }
        )
    return rows


def _most(x: Array) -> float | None:
    known = np.abs(x[np.isfinite(x)])
    return float(known.max()) if known.size else None


def _spans(flag: Flags, dt: float) -> list[SpanRow]:
    """Stretches of at least a tenth of a second, the longest where there are very many."""
    spans = [(a * dt, b * dt) for a, b in runs_of(flag)]
    long = sorted((s for s in spans if s[1] - s[0] >= _LEAST_S), key=lambda s: s[0] - s[1])[:_MOST_SPANS]
    return [{"start_s": a, "stop_s": b} for a, b in sorted(long)]
