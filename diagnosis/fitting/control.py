"""Control law, λ, ζ and Ψ̂(0) from the recorded commands of healthy missions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.fitting.robust import Estimate
from replay.control.law_fit import MIN_EXPLAINED, LawFit
from replay.control.local_fit import PiFit
from replay.control.loop import Replay, stack
from replay.control.mfhca import LAW_TEXT
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_FAR = 0.2
_UNIT_NEAR = 0.08
_VERY_FAR = 3.0
_SURE = 2.0  # standard deviations
_ROUGH = 0.7


@dataclass(frozen=True)
class ControlFit:
    """The law that most missions ran.

    Attributes
    ----------
    law, psi : str
        Reading of L15 (14) and mode of Ψ̂; empty where none explains the commands.
    lambda_, zeta, psi0 : Estimate
        λ̂ [s/m], ζ̂ [s/m²] of the forced mode, Ψ̂(0) of the printed mode.
    explained : float
        Share of the command's variation that it explains, the least of the missions.
    increments : Estimate
        λ̂ from increments Δu on Δe of unsaturated samples [s/m], with the condition under which it holds.
    missions, left_missions : tuple[int, ...]
        Missions that agree, and those that do not.
    why : str
        Why nothing is given.
    pi : PiFit or None
        Proportional and integral law with feed-forward of most missions, where no reading explains them.
    """

    law: str
    psi: str
    lambda_: Estimate
    zeta: Estimate
    psi0: Estimate
    explained: float
    increments: Estimate
    missions: tuple[int, ...]
    left_missions: tuple[int, ...]
    why: str = ""
    pi: PiFit | None = None


def _nothing(why: str) -> ControlFit:
    none, same = (Estimate(float("nan"), float("nan"), text) for text in (why, "as control.lambda"))
    return ControlFit("", "", none, same, same, float("nan"), none, (), (), why)


def _other_law(replays: Sequence[Replay]) -> ControlFit | None:
    """The law of missions whose commands a PI controller with feed-forward explains; None where it is not most of them."""
    found = {m: r.pi for m, r in enumerate(replays) if r.pi is not None}
    if len(found) <= sum(bool(r.fits) for r in replays) / 2:
        return None
    gains = np.array([(p.feed_forward, p.kp, p.ki) for p in found.values()])
    spreads = np.array([p.spread for p in found.values()])
    ff, kp, ki = (float(x) for x in np.median(gains, axis=0))
    spread = tuple(float(x) for x in np.maximum(gains.std(axis=0), np.median(spreads, axis=0)))
    pi = PiFit(ff, kp, ki, spread, min(p.explained for p in found.values()))  # type: ignore[arg-type]
    left = tuple(m for m, r in enumerate(replays) if r.fits and m not in found)
    return replace(_nothing("a PI law with feed-forward has none"), missions=tuple(found), left_missions=left, pi=pi)


def fit_control(
    timelines: Sequence[Timeline], replays: Sequence[Replay], machine: Machine, bad: set[str]
) -> ControlFit:
    """Choose the reading that explains most missions, and average its constants over them.

    Parameters
    ----------
    timelines, replays : Sequence
        Aligned and replayed missions; the replays' `fits` hold every reading.
    machine : Machine
        Its law, where it fixes one.
    bad : set[str]
        Signals with a unit error.
    """
    if machine.control.law == "none":
        return _nothing("control.law = none: another controller")
    spoiled = sorted(s for s in bad if s.rpartition(".")[2] in ("v", "v_ref", "u") or s == "cmd.v")
    if spoiled:
        return _nothing(f"{spoiled[0]} has a wrong unit or sign")
    fits = {m: r.fits for m, r in enumerate(replays) if r.fits}
    if not fits:
        return _nothing("no recorded valve command with the speed and its command")
    good = {m: f[0] for m, f in fits.items() if f[0].explained >= MIN_EXPLAINED and f[0].lambda_ > 0}
    if len(good) <= len(fits) / 2:
        other = _other_law(replays)
        if other is not None:
            return other
        best = float(np.median([f[0].explained for f in fits.values()]))
        return _nothing(
            f"no reading of the law explains the recorded commands (best {100 * best:.0f} %, needed "
            f"{100 * MIN_EXPLAINED:.0f} %): another controller, or a log too slow to resolve Ψ̂"
        )
    names = [(f.law, f.psi) for f in good.values()]
    law, psi = max(dict.fromkeys(names), key=names.count)
    same = {m: f for m, f in good.items() if (f.law, f.psi) == (law, psi)}
    values = np.array([f.lambda_ for f in same.values()])
    middle = float(np.median(values))
    kept = {m: f for m, f in same.items() if abs(f.lambda_ / middle - 1) < _FAR}
    left = tuple(sorted(set(fits) - set(kept)))
    chosen = list(kept.values())
    psi0 = [p for f in chosen for p in f.psi0 if p > 0]
    none = Estimate(float("nan"), float("nan"), f"Ψ̂ is {psi}")
    return ControlFit(
        law,
        psi,
        _mean([f.lambda_ for f in chosen], [f.lambda_std for f in chosen]),
        _mean([f.zeta for f in chosen], []) if psi == "forced" else none,
        _mean(psi0, []) if psi == "printed" and psi0 else none,
        min(f.explained for f in chosen),
        _increments([(timelines[m], replays[m]) for m in kept], chosen[0], machine),
        tuple(sorted(kept)),
        left,
    )


def _mean(values: list[float], within: list[float]) -> Estimate:
    """Median over missions; standard deviation over missions, and over wheels where there is one mission."""
    spread = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
    inner = float(np.median(within)) if within else float("nan")
    std = spread if not np.isfinite(inner) else inner if not np.isfinite(spread) else max(spread, inner)
    return Estimate(float(np.median(values)), std)


def _increments(missions: Sequence[tuple[Timeline, Replay]], fit: LawFit, machine: Machine) -> Estimate:
    """λ̂ = −Σ Δu·Δe / Σ Δe² over unsaturated steps."""
    values = []
    for timeline, r in missions:
        u = stack(timeline, [f"wheel.{w}.u" for w in machine.wheels])
        free = np.abs(u) < machine.control.u_max * (1 - 1e-9)
        for i in range(u.shape[1]):
            both = free[1:, i] & free[:-1, i]
            du, de = np.diff(u[:, i])[both], np.diff(r.e[:, i])[both]
            known = np.isfinite(du) & np.isfinite(de)
            power = float(de[known] @ de[known])
            if power > 0:
                values.append(-float(du[known] @ de[known]) / power)
    if not values:
        return Estimate(float("nan"), float("nan"), "no unsaturated steps")
    condition = (
        "holds, since Ψ̂² adds with sgn(v_c)"
        if fit.law in ("signed", "sign_abs")
        else "biased, since Ψ̂² enters with sgn(e) or |v|: the joint fit counts"
    )
    return Estimate(float(np.median(values)), float(np.std(values)), condition)


def lambda_doubt(
    fit: ControlFit, machine: Machine, factors: dict[str, tuple[float, str]]
) -> tuple[str, tuple[str, ...]]:
    """Sentence about a λ̂ far from the machine file's, and which signals of the wheels it puts in doubt.

    Empty where λ̂ is near, where its standard deviation leaves that open, or where it is only unlike a λ that the file leaves
    open (law = auto) by less than a factor of three. What λ̂ could be within two standard deviations counts, never λ̂ alone.
    """
    if not fit.law:
        return "", ()
    ratio = fit.lambda_.value / machine.control.lambda_
    doubt = _SURE * float(np.nan_to_num(fit.lambda_.std)) / machine.control.lambda_
    if abs(ratio - 1) <= max(_FAR, doubt):
        return "", ()
    condition = f"{LAW_TEXT[fit.law]}, Ψ̂ {fit.psi}, fitted jointly, {100 * fit.explained:.1f} % explained"
    stated = f"{fit.lambda_.value:.4g} ± {np.nan_to_num(fit.lambda_.std):.2g}"
    head = f"λ̂ = {stated} s/m is {ratio:.3g} times control.lambda = {machine.control.lambda_:g} ({condition})"
    very_far = ratio - doubt > _VERY_FAR or ratio + doubt < 1 / _VERY_FAR
    # with a wrong unit ρ is wrong too, and λ̂ a little with it
    reach = _ROUGH if very_far else _UNIT_NEAR
    near = {n: abs(float(np.log(ratio * f))) for n, (f, _) in factors.items()}
    named = sorted((n for n in near if near[n] < reach), key=near.__getitem__)
    if abs(np.log(abs(ratio)) - np.log(100.0)) < _UNIT_NEAR or abs(np.log(ratio) + np.log(100.0)) < _UNIT_NEAR:
        which = (
            'percent read as a fraction: unit = "%"' if ratio > 1 else 'a fraction read as percent: unit = "fraction"'
        )
        return f"{head}: as if u were {which} in [signals]", ("u",)
    if named:
        shown = ", or ".join(f"{n} ({factors[n][1]})" for n in named[:4])
        return (
            f"{head}: as if v and v_ref of all wheels had a wrong unit, {shown}; check them in [signals], or give the "
            "right control.lambda",
            ("v", "v_ref"),
        )
    if very_far or machine.control.law != "auto":
        text = f"{head}: check the units of u, v and v_ref in [signals], or give the right control.lambda"
        return text, ("u", "v", "v_ref") if very_far else ()
    return "", ()
