"""With which law, mode of Ψ̂ and constants a mission is replayed: the machine file's, or those that fit its commands; and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.control import mfhca
from replay.control.law_fit import MIN_EXPLAINED, LawFit, fit_law
from replay.control.local_fit import PiFit, fit_pi
from replay.control.loop_kernel import LoopLaw
from replay.machine.config import Machine
from replay.number_words import told

Array = NDArray[np.float64]

#: What a reading says of a law that does not explain the recorded commands.
UNEXPLAINED = "no reading explains it well"
_UNKNOWN_LEAD = 0.5


@dataclass(frozen=True)
class Reading:
    """One reading of the paper that was used: name, value, and why."""

    name: str
    value: str
    detail: str = ""


def choose_law(
    machine: Machine, u: Array, v: Array, v_ref: Array, dt: float, unfit: str, readings: list[Reading]
) -> tuple[LoopLaw | None, list[float | None], tuple[LawFit, ...], PiFit | None]:
    """Law, mode of Ψ̂ and constants to replay with; Ψ̂(0) of each wheel, None where it is to be fitted; and what was fitted.

    `u`, `v` and `v_ref` of shape (n, wheels): fractions of opening, m/s, m/s; `dt` in s.
    """
    control = machine.control
    given = [control.psi0] * len(machine.wheels)

    def chosen(law: str, psi: str, lambda_: float, zeta: float, lead: float = _UNKNOWN_LEAD) -> LoopLaw:
        return LoopLaw(law, psi, lambda_, zeta, control.u_max, control.xi, control.beta, lead)

    if control.law == "none":
        readings.append(Reading("control law", "none", "another controller: no Ψ̂ and no controller evidence"))
        return None, given, (), None
    laws = tuple(mfhca.LAW_TEXT) if control.law == "auto" else (control.law,)
    fits = (
        fit_law(u, v, v_ref, dt, xi=control.xi, beta=control.beta, u_max=control.u_max, laws=laws) if not unfit else ()
    )
    if not fits:
        law: str = "signed" if control.law == "auto" else control.law
        why = unfit or "too few usable samples to fit"
        readings.append(Reading("control law", f"{law}: {mfhca.LAW_TEXT[law]}", f"{why}; λ = {control.lambda_:g} s/m"))
        readings.append(Reading("adaptive law Ψ̂", "printed only", why))
        return chosen(law, "printed", control.lambda_, control.zeta), given, (), None
    best = fits[0]
    fitted = control.law == "auto" and best.explained >= MIN_EXPLAINED
    if control.law == "auto" and not fitted:
        pi = fit_pi(u, v, v_ref, dt, control.u_max, machine.limits.driving_speed)
        if pi is not None and pi.explained >= MIN_EXPLAINED:
            readings.append(_other_law(pi))
            return None, given, fits, pi
    law = best.law
    lambda_ = best.lambda_ if fitted and best.lambda_ > 0 else control.lambda_
    detail = (
        f"fit: λ̂ = {_number(best.lambda_)} ± {best.lambda_std:.2g} s/m with Ψ̂ {best.psi}"
        + (f", ζ̂ = {_number(best.zeta)} s/m²" if best.psi == "forced" else "")
        + f"; explains {100 * best.explained:.1f} % of the recorded command"
    )
    if control.law == "auto" and not fitted:
        detail += f"; {UNEXPLAINED}: the log may come from another controller"
    readings.append(
        Reading("control law", f"{law}: {mfhca.LAW_TEXT[law]}", f"{detail}; replayed with λ = {lambda_:.4g} s/m")
    )
    mode: str = control.psi
    zeta = control.zeta
    if mode == "auto":
        mode = best.psi if fitted else "printed"
        zeta = best.zeta if best.psi == "forced" and fitted else control.zeta
    text = {
        "printed": "L16 (13) as printed, exact exponential per step; Ψ̂(0) fitted"
        if control.psi0 is None
        else "as printed",
        "implied": "from the recorded command",
        "event_reset": "as printed, re-initialised at jumps of the implied value",
        "forced": f"Ψ̂' = −ρΨ̂ + ½ζe², ζ = {zeta:.4g} s/m², {_order_text(best)}",
    }[mode]
    readings.append(Reading("adaptive law Ψ̂", mode, text))
    if mode == "printed" and control.psi0 is None:
        given = list(best.psi0)
    return chosen(law, mode, lambda_, zeta, best.lead if best.psi == "forced" else _UNKNOWN_LEAD), given, fits, None


def _order_text(fit: LawFit) -> str:
    """Which share of its own step a command's Ψ̂ holds."""
    if fit.psi != "forced":
        return "order not known"
    words = {0.0: "the command is given before Ψ̂ takes its step", 1.0: "Ψ̂ takes its step before the command is given"}
    return words.get(round(fit.lead, 2), f"a command holds {100 * fit.lead:.0f} % of its own step")


def _other_law(pi: PiFit) -> Reading:
    return Reading(
        "control law",
        f"proportional and integral with feed-forward: {pi.text}",
        f"explains {100 * pi.explained:.1f} % of the command within a second, no reading of MFHCA's law does; it has no Ψ̂ to replay",
    )


def _number(value: float) -> str:
    return told(value, ".4g")
