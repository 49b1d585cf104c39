"""Terms of the proof on wheels whose loads are known."""

from __future__ import annotations

import numpy as np
import pytest

from replay.control.lyapunov import ProofConstants, ProofTerms, proof_terms

K, TAU, DT, LAMBDA = 2.4, 0.25, 1e-3, 1.0
CONSTANTS = ProofConstants(np.array([K]), np.array([TAU]), LAMBDA, 1.0, 0.001)


def terms(let: float, load: float, zeta: float) -> tuple[ProofTerms, np.ndarray]:
    """A wheel under u = −λe + Ψ̂² for 6 s with v_c = 0.2 + 0.05 sin 2t, its speed hidden from 3 to 3.5 s; and the true D."""
    t = np.arange(0.0, 6.0, DT)
    v_c = 0.2 + 0.05 * np.sin(2 * t)
    v, u, psi = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
    x, p = 0.2, 0.3
    for k in range(t.size):
        e = x - v_c[k]
        v[k], psi[k], u[k] = x, p, -LAMBDA * e + p * p
        x += DT / TAU * (K * let * u[k] + load - x)
        p += DT * (-(0.001 + v_c[k] + abs(x) + 1.0) * p + 0.5 * zeta * e * e)
    known = np.where((t >= 3.0) & (t < 3.5), np.nan, v)
    column = lambda values: np.asarray(values)[:, None]  # noqa: E731
    found = proof_terms(column(known), column(v_c), column(u), column(psi), np.full((t.size, 1), let), CONSTANTS, DT)
    return found, load / TAU - 0.1 * np.cos(2 * t)


@pytest.mark.parametrize(("let", "load"), [(1.0, -0.05), (0.5, 0.02)])
def test_lumped_terms_are_those_of_the_wheel(let: float, load: float) -> None:
    found, true = terms(let, load, 0.0)
    seen = np.isfinite(found.D[:, 0])
    assert np.abs(found.D[seen, 0] - true[seen]).max() < 0.01
    assert not np.isfinite(found.D[3000:3500, 0]).any()
    assert not found.uncontrolled.any()


def test_the_printed_law_keeps_to_its_bound() -> None:
    found, _ = terms(1.0, 0.0, 0.0)
    assert not found.broken.any()
    assert np.nanmin(found.V) >= 0.0


def test_a_psi_that_is_driven_does_not() -> None:
    found, _ = terms(0.0, 0.0, 2000.0)
    assert found.broken.any()
    assert found.uncontrolled.all()


def test_a_mission_shorter_than_the_window_has_no_rates() -> None:
    x = np.full((5, 1), 0.1)
    found = proof_terms(x, x, x, x, np.ones((5, 1)), CONSTANTS, DT)
    assert not np.isfinite(found.rate).any()
    assert not found.broken.any()
