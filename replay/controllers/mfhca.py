"""The paper's law in its readings, as a controller that runs: L15 (14) with Ψ̂ of L16 (13), forced or as printed (compiled).

    ρ  = β + |v_c| + |y| + ξ
    Ψ̂' = −ρ Ψ̂ + ½ ζ e²          ζ = 0: as printed; exact exponential per step
    u  by the reading of the law (`READINGS`)

4 parameters as the paper counts them: λ, β, ξ, and k_ps of the steering. A forced Ψ̂ adds ζ, which the paper does not have.
Ψ̂ is advanced before the command is given, by the recorded order of the simulated controller; nothing stops it while the
command is clipped, for the paper has nothing that would.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.limits import F, clipped

#: Readings of L15 (14) by their code in compiled loops.
READINGS: tuple[str, ...] = ("opposed", "signed", "printed", "sign_abs", "p", "event_reset")
EVENT_RESET = READINGS.index("event_reset")
EVENT_RISE = 0.03  # rise of |e| that resets Ψ̂ [m/s]


class MfhcaGains(NamedTuple):
    """Parameters of the paper, and of its readings."""

    reading: int = 0
    lambda_: float = 1.0  # [s/m]
    beta: float = 0.001  # [1/s]
    xi: float = 1.0  # [1/s]
    zeta: float = 2600.0  # of the preset paper-table [s/m²]; 0: Ψ̂ as printed
    lead: float = 1.0  # share of its own step that Ψ̂ has taken when the command is given


MFHCA_STATES = 1  # Ψ̂


@njit(cache=True, no_cpython_wrapper=True)
def read_law(reading: int, v_ref: float, v: float, psi: float, lam: float, u_max: float) -> float:
    """u_a in its readings, L15 (14): 0 opposed, 1 signed, 2 printed, 3 sign_abs, 4 proportional alone, 5 event_reset.

    Speeds in m/s, commands in fractions of full opening.
    """
    e = v - v_ref
    s = 1.0 if v_ref >= 0.0 else -1.0
    if reading == 0:
        u = -lam * e - np.sign(e) * psi * psi
    elif reading == 1 or reading == 5:
        u = -lam * e + s * psi * psi
    elif reading == 2:
        u = -lam * abs(v) + lam * abs(v_ref) + psi * psi
    elif reading == 3:
        u = s * (lam * (abs(v_ref) - abs(v)) + psi * psi)
    else:
        u = -lam * e
    return float(clipped(u, u_max))


@njit(cache=True, no_cpython_wrapper=True)
def mfhca_step(v_ref: F, y: F, dt: float, u_max: float, g: MfhcaGains, s: F, u: F) -> None:
    """Command of every wheel into `u`, shape (wheels,); `s`, shape (wheels, MFHCA_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    for i in range(y.size):
        before = s[i, 0]
        rho = g.beta + abs(v_ref[i]) + abs(y[i]) + g.xi
        s[i, 0] = before * np.exp(-rho * dt) + 0.5 * g.zeta * (y[i] - v_ref[i]) ** 2 * dt
        psi = before + g.lead * (s[i, 0] - before)
        u[i] = read_law(g.reading, v_ref[i], y[i], psi, g.lambda_, u_max)
