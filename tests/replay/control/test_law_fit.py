"""The law, λ, ζ and Ψ̂(0) are found again from what a simulated loop logged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.control.law_fit import LawFit, fit_law
from replay.control.mfhca import decay_rate, forced_psi
from replay.machine.config import Control, haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

DT = 0.001
WHEELS = haulotte().wheels
Array = np.ndarray


def logged(law: str, zeta: float, psi0: float, lambda_: float, u_max: float = 1.0) -> tuple[Array, Array, Array]:
    """u, v and v_c of a mission of 20 s that drives in reverse, stops and starts again."""
    control = Control(lambda_=lambda_, u_max=u_max)
    mission = simulate_mission(
        SimulationOptions(
            scenario="healthy",
            seed=4,
            duration_s=20.0,
            evidence="base",
            law=law,  # type: ignore[arg-type]
            zeta=zeta,
            psi0=psi0,
            machine=replace(haulotte(), control=control),
        )
    )
    u, v, v_c = (
        np.column_stack([mission.columns[f"wheel.{w}.{leaf}"] for w in WHEELS]) for leaf in ("u", "v", "v_ref")
    )
    return u, v, v_c


def fit(u: Array, v: Array, v_c: Array, u_max: float = 1.0, **more: tuple[str, ...]) -> tuple[LawFit, ...]:
    return fit_law(u, v, v_c, DT, xi=1.0, beta=0.001, u_max=u_max, **more)


@pytest.mark.parametrize(
    ("law", "zeta", "lambda_"),
    [("opposed", 1000.0, 1.0), ("opposed", 400.0, 2.0), ("signed", 10.0, 1.0)],
)
def test_forced_laws_are_recovered(law: str, zeta: float, lambda_: float) -> None:
    best = fit(*logged(law, zeta, 0.0, lambda_))[0]
    assert (best.law, best.psi) == (law, "forced")
    assert best.lambda_ == pytest.approx(lambda_, rel=0.01)
    assert best.zeta == pytest.approx(zeta, rel=0.005)
    assert best.explained > 0.9999
    assert best.psi0 == (0.0,) * 4


@pytest.mark.parametrize(
    ("law", "psi0", "lambda_"),
    [("signed", 0.6, 1.0), ("signed", 0.6, 6.9), ("printed", 0.5, 1.0), ("sign_abs", 0.5, 0.4)],
)
def test_decaying_laws_are_recovered(law: str, psi0: float, lambda_: float) -> None:
    best = fit(*logged(law, 0.0, psi0, lambda_))[0]
    assert (best.law, best.psi) == (law, "printed")
    assert best.lambda_ == pytest.approx(lambda_, rel=1e-4)
    assert best.lambda_std < 3e-4 * lambda_ + 1e-4
    assert best.psi0 == pytest.approx((psi0,) * 4, rel=0.002)
    assert best.zeta == 0.0
    assert best.explained > 0.9999


def test_saturated_samples_are_left_out() -> None:
    u, v, v_c = logged("opposed", 1000.0, 0.0, 1.0, u_max=0.1)
    saturated = np.abs(u) >= 0.1
    assert 0.3 < saturated.mean() < 0.8
    best = fit(u, v, v_c, u_max=0.1)[0]
    assert (best.law, best.psi) == ("opposed", "forced")
    assert best.lambda_ == pytest.approx(1.0, rel=0.01)
    assert best.zeta == pytest.approx(1000.0, rel=0.005)
    # as many commands taken at face value would say otherwise
    assert abs(fit(u, v, v_c, u_max=1.0)[0].lambda_ - 1.0) > 0.05


def test_samples_without_value_are_left_out() -> None:
    u, v, v_c = logged("signed", 0.0, 0.6, 1.0)
    u[5000:9000, 0] = np.nan
    v[12_000:13_000, 1] = np.nan
    u[:, 2] = np.nan
    best = fit(u, v, v_c)[0]
    assert (best.law, best.psi) == ("signed", "printed")
    assert best.lambda_ == pytest.approx(1.0, rel=1e-3)
    assert best.psi0[2] == 0.0
    assert best.psi0[0] == pytest.approx(0.6, rel=0.002)


def test_only_the_asked_laws_are_tried() -> None:
    fits = fit(*logged("signed", 0.0, 0.6, 1.0), laws=("printed",))
    assert {f.law for f in fits} == {"printed"}
    assert [f.rms for f in fits] == sorted(f.rms for f in fits)


def test_another_controller_is_not_explained() -> None:
    _, v, v_c = logged("opposed", 1000.0, 0.0, 1.0)
    unrelated = 0.1 * np.random.default_rng(7).normal(size=v.shape)
    assert fit(unrelated, v, v_c)[0].explained < 0.05


def test_too_few_samples_give_no_fit() -> None:
    u, v, v_c = (np.ones((500, 2)) * x for x in (0.1, 0.2, 0.3))
    u[99:] = np.nan
    assert fit(u, v, v_c) == ()


def mission_at(rate: float, seed: int = 3, **more: object) -> tuple[Array, Array, Array]:
    """u, v and v_c of a healthy mission that is controlled at 1 kHz and recorded at a rate."""
    options = SimulationOptions(scenario="healthy", seed=seed, duration_s=40.0, rate_hz=rate, evidence="base")
    mission = simulate_mission(replace(options, **more))  # type: ignore[arg-type]
    u, v, v_c = (
        np.column_stack([mission.columns[f"wheel.{w}.{leaf}"] for w in WHEELS]) for leaf in ("u", "v", "v_ref")
    )
    return u, v, v_c


@pytest.mark.parametrize("rate", [1000.0, 500.0, 200.0, 100.0, 50.0])
def test_lambda_does_not_depend_on_the_recorded_rate(rate: float) -> None:
    """Above 1 kHz the order tells all; below, Ψ̂ lacks what forced it between two samples, and λ must not take it up."""
    best = fit_law(*mission_at(rate), 1.0 / rate, xi=1.0, beta=0.001, u_max=1.0)[0]
    assert (best.law, best.psi) == ("opposed", "forced")
    assert best.lambda_ == pytest.approx(1.0, abs=0.012)
    assert abs(best.lambda_ - 1.0) < 3 * best.lambda_std + 1e-4
    assert best.zeta == pytest.approx(1000.0, rel=0.02)


def test_the_order_of_the_simulated_controller_is_found() -> None:
    """It advances Ψ̂ by its own sample's error before it gives the command."""
    best = fit_law(*mission_at(1000.0), 1e-3, xi=1.0, beta=0.001, u_max=1.0)[0]
    assert best.lead == pytest.approx(1.0, abs=0.02)
    assert best.rms < 1e-5


def test_the_other_order_is_found() -> None:
    """The same commands, each given before Ψ̂ takes its step."""
    u, v, v_c = mission_at(1000.0)
    for i in range(4):
        e = v[:, i] - v_c[:, i]
        psi, _ = forced_psi(decay_rate(v[:, i], v_c[:, i], 1.0, 0.001), e, 1e-3, 1000.0)
        u[:, i] = -e - np.sign(e) * psi**2
    best = fit_law(u, v, v_c, 1e-3, xi=1.0, beta=0.001, u_max=1.0)[0]
    assert best.lead == pytest.approx(0.0, abs=0.02)
    assert best.lambda_ == pytest.approx(1.0, abs=1e-3)
