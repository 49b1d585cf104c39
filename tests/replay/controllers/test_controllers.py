"""Controllers against an independent integrator of the same closed loop, and what all of them share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from replay.controllers.choice import CONTROLLERS, Controller, command, controller_state
from replay.errors import ConfigError

K, TAU, STEP, END = 2.4, 0.25, 2e-4, 3.0
Vector = np.ndarray
#: u and the derivatives of the controller's states, from v_c, y, the states and the gains.
Law = Callable[[float, float, Vector, dict[str, float]], tuple[float, Vector]]


def v_ref(t: float) -> float:
    return 0.25 * np.sin(1.3 * t) + 0.05


def proportional(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    return -g["k"] * (y - c), np.zeros(0)


def pi(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    e = y - c
    return g["ff"] * c - g["kp"] * e - g["ki"] * x[0], np.array([e])


def adaptive(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    e, theta, rho, filtered = y - c, x[:5], x[5], x[6]
    rate = (c - filtered) / g["tau_f"]
    phi = np.array([c, np.tanh(c), 1.0, rate, y])
    soft = np.tanh(e / g["epsilon"])
    names = ("v", "tanh", "one", "rate", "y")
    gamma, sigma = (np.array([g[f"{leaf}_{n}"] for n in names]) for leaf in ("gamma", "sigma"))
    learned = gamma * (phi * e - sigma * theta)
    grown = g["gamma_rho"] * (e * soft - g["sigma_rho"] * rho)
    return -g["k"] * e - theta @ phi - rho * soft, np.array([*learned, grown, rate])


def finite_time(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    e = y - c
    s = e + g["c"] * x[0]
    u = -g["k1"] * s - g["k2"] * np.abs(s) ** g["beta"] * np.sign(s) - x[1] * np.tanh(s / 0.02)
    return u, np.array([np.abs(e) ** g["alpha"] * np.sign(e), g["gamma"] * (np.abs(s) - g["sigma"] * x[1])])


def neural(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    e = y - c
    basis = np.exp(-(((c - np.linspace(-g["range"], g["range"], 9)) / g["width"]) ** 2))
    return -g["k"] * e - x @ basis - g["k_r"] * np.tanh(e / 0.02), g["gamma"] * (basis * e - g["sigma"] * x)


def fuzzy(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    e, theta, integral, filtered = y - c, x[:9], x[9], x[10]
    rate = (e - filtered) / g["tau_f"]
    centres = np.array([-1.0, 0.0, 1.0])
    of_speed = np.exp(-(((np.clip(g["g_v"] * c, -1, 1) - centres) / g["w_v"]) ** 2))
    of_change = np.exp(-(((np.clip(g["g_d"] * rate, -1, 1) - centres) / g["w_d"]) ** 2))
    rules = np.outer(of_speed, of_change).ravel()
    rules /= rules.sum()
    u = -g["k"] * e - g["k_i"] * integral - g["g_u"] * rules @ theta - g["k_r"] * np.tanh(e / g["epsilon"])
    return u, np.array([*(g["gamma"] * (rules * e - g["sigma"] * theta)), e, rate])


def mfhca(c: float, y: float, x: Vector, g: dict[str, float]) -> tuple[float, Vector]:
    """The reading ``signed``, which is smooth."""
    e = y - c
    rho = g["beta"] + abs(c) + abs(y) + g["xi"]
    return -g["lambda"] * e + np.sign(c) * x[0] ** 2, np.array([-rho * x[0] + 0.5 * g["zeta"] * e * e])


LAWS: dict[str, tuple[Law, int]] = {
    "mfhca": (mfhca, 1),
    "p": (proportional, 0),
    "pi": (pi, 1),
    "adaptive": (adaptive, 7),
    "finite-time": (finite_time, 2),
    "neural": (neural, 9),
    "fuzzy": (fuzzy, 11),
}


def stepped(controller: Controller, step: float = STEP, end: float = END, offset: float = 0.0) -> tuple[Vector, Vector]:
    """Speed and command of two wheels alike, by the compiled step and explicit Euler."""
    state, u, v = controller_state(2), np.zeros(2), np.zeros(2)
    speeds, commands = [], []
    gains = controller.gains()
    for k in range(round(end / step)):
        command(controller.kind.code, np.full(2, v_ref(k * step)), v + offset, step, 1.0, gains, state, u)
        speeds.append(v.copy())
        commands.append(u.copy())
        v += step / TAU * (K * u - v)
    return np.array(speeds), np.array(commands)


@pytest.mark.parametrize("name", LAWS)
def test_the_closed_loop_is_that_of_an_independent_integrator(name: str) -> None:
    values = {"zeta": 20.0} if name == "mfhca" else {}
    controller = Controller(name, values, "signed")
    law, states = LAWS[name]
    gains = controller.own

    def rates(t: float, x: Vector) -> Vector:
        u, change = law(v_ref(t), x[0], x[1:], gains)
        return np.array([(K * np.clip(u, -1, 1) - x[0]) / TAU, *change])

    times = np.arange(0.0, END, STEP)
    found = solve_ivp(rates, (0.0, END), np.zeros(1 + states), t_eval=times[::50], rtol=1e-7, atol=1e-9, max_step=0.01)
    speeds, _ = stepped(controller)
    assert np.abs(speeds[::50, 0] - found.y[0]).max() < 1.5e-3
    np.testing.assert_array_equal(speeds[:, 0], speeds[:, 1])


@pytest.mark.parametrize(
    ("name", "count"), [("p", 1), ("pi", 3), ("adaptive", 16), ("finite-time", 7), ("neural", 6), ("fuzzy", 12)]
)
def test_parameters_are_as_many_as_in_the_papers_table(name: str, count: int) -> None:
    assert CONTROLLERS[name].parameters == count == len(Controller(name).own)


def test_mfhca_has_the_papers_four_and_its_forcing() -> None:
    assert CONTROLLERS["mfhca"].parameters == 4  # λ, β, ξ, and k_ps of the steering
    assert set(Controller("mfhca").own) == {"lambda", "beta", "xi", "zeta"}


@pytest.mark.parametrize("name", ["pi", "adaptive", "finite-time", "neural", "fuzzy"])
def test_a_speed_out_of_reach_winds_nothing_up(name: str) -> None:
    controller = Controller(name)
    state, u, gains = controller_state(1), np.zeros(1), controller.gains()

    def run(y: float, steps: int) -> float:
        for _ in range(steps):
            command(controller.kind.code, np.array([0.3]), np.array([y]), 1e-3, 1.0, gains, state, u)
        return float(u[0])

    assert run(-4.0, 20) == 1.0
    held = state.copy()
    assert run(-4.0, 5000) == 1.0
    grown = np.abs(state - held)
    if name in ("adaptive", "fuzzy"):
        grown[:, -1] = 0.0  # filters go on
        grown[:, 6 if name == "adaptive" else 10] = 0.0
    assert grown.max() == 0.0
    assert run(0.5, 400) < 0.9


def test_commands_stay_within_the_valve() -> None:
    for name in CONTROLLERS:
        _, u = stepped(Controller(name), 1e-3, 1.0, offset=5.0)
        assert np.abs(u).max() <= 1.0


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("lqr", {}, "controller 'lqr' is not known; expected one of mfhca, p, pi"),
        ("fuzzy", {"kp": 1.0}, "fuzzy has no parameter 'kp'; expected one of k, k_i"),
        ("fuzzy", {"tau_f": 0.0}, "tau_f = 0 is out of range; expected more than 0"),
        ("finite-time", {"alpha": 1.5}, "alpha = 1.5 is out of range; expected 0 to 1"),
        ("p", {"k": float("nan")}, "k = nan is out of range"),
    ],
)
def test_wrong_names_and_values_are_named(name: str, values: dict[str, float], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Controller(name, values)
