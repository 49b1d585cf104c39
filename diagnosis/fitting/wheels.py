"""Wheel constants K, τ, dead zone, offset and load from the windows of healthy missions.

Steady windows give the effort map: K from how speed goes with opening over all windows and missions, its kink at zero
the dead zone, its shift the offset. The command is the instrument, since a controller that holds the speed against a
load makes effort and load go together. Windows in which the speed changes give τ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.fitting.robust import UNKNOWN, Estimate, equal_weights, jackknife, robust_solve, solve
from diagnosis.fitting.windows import WINDOW_S, Cuts, WheelRecord, Windows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_TAUS = np.geomspace(0.01, 3.0, 13)
_RESOLVED = 1.5  # steps of the log: a shorter lag is known to half a step at best
_LEAST_WINDOWS = 8
_FLOOR = 0.05
_MAX_LEFT_OUT = 1 / 3
_FULL = 5
_SPREAD_OF_SPEED = 0.12
_MISSION_LIMIT = 0.1
_CUT_MISSION = 5.0
_LAG_DOUBT = 0.01  # a wheel is no exact first-order lag


@dataclass(frozen=True)
class WheelFit:
    """What the missions say of one wheel.

    Attributes
    ----------
    K, tau, dead, offset : Estimate
        See `replay.machine.config.WheelPlant`; dead may be negative where loads hide it.
    weight : Array, shape (windows,)
        Weight of each window; 0 for those that disagree.
    group : NDArray[np.int64], shape (windows,)
        Mission, or part of the mission, of each window.
    considered : int
        Steady windows of the missions that agree.
    missions, left_missions : tuple[int, ...]
        Missions that the figures come from, and those that disagree with the others.
    refused : str
        Why nothing is given; empty where the figures hold.
    load : Estimate
        See `replay.machine.config.WheelPlant`.
    odd : tuple[tuple[int, int], ...]
        Steady windows that disagree: mission, and the window's number in it.
    left_share : float
        Share of the steady windows that disagree.
    """

    K: Estimate
    tau: Estimate
    dead: Estimate
    offset: Estimate
    weight: Array
    group: NDArray[np.int64]
    considered: int
    missions: tuple[int, ...]
    left_missions: tuple[int, ...]
    refused: str = ""
    load: Estimate = UNKNOWN
    odd: tuple[tuple[int, int], ...] = ()
    left_share: float = 0.0

    @property
    def used(self) -> int:
        """Windows that agree."""
        return int(np.count_nonzero(self.weight))


@dataclass(frozen=True)
class _Map:
    """The effort map p = y/K + a·s + b over steady windows."""

    K: float
    kink: float
    shift: float
    weight: Array  # 0 for windows that disagree
    shape: str  # "full", "one way", "shift", "origin"
    std: Array  # of K, kink, shift
    speeds: bool  # whether more than one speed was driven


def _columns(shape: str, y: Array, s: Array) -> Array:
    one = np.ones_like(y)
    return np.column_stack({"full": (y, s, one), "one way": (y, s), "shift": (y, one), "origin": (y,)}[shape])


def _unpacked(shape: str, beta: Array) -> Array:
    """K, kink and shift of a solution."""
    kink = beta[1] if shape in ("full", "one way") else 0.0
    shift = beta[-1] if shape in ("full", "shift") else 0.0
    return np.array([1.0 / beta[0] if beta[0] != 0 else np.nan, kink, shift])


def _effort_map(w: Windows, kept: Mask, dead: float) -> _Map | None:
    """Fit the map to the steady windows of missions that are kept."""
    use = w.steady & ~w.frozen & kept
    if np.count_nonzero(use) < _LEAST_WINDOWS:
        return None
    y, p, z = w.y[use], w.p[use], w.z[use]
    s = np.sign(z)
    weight = equal_weights(w.mission[use], _FULL)
    both = min(weight[s > 0].sum(), weight[s < 0].sum()) > 0.15 * weight.sum()
    size = np.abs(z)
    mean = float(np.average(size, weights=weight))
    spread = float(np.sqrt(np.average((size - mean) ** 2, weights=weight))) / mean
    shape = ("full" if both else "one way") if spread > _SPREAD_OF_SPEED else ("shift" if both else "origin")
    with_zone: float | None = None
    while True:
        x, inst = _columns(shape, y, s), _columns(shape, z, s)
        beta, agree = robust_solve(x, inst, p, weight, _FLOOR * float(np.median(np.abs(p))))
        if not np.isfinite(beta).all() or beta[0] == 0.0:
            return None  # not fixed, or no opening answers to speed
        good = np.flatnonzero(agree > 0)
        groups = w.group[use][good]

        def again(mask: Mask) -> Array:
            rows = good[mask]  # noqa: B023 - called in this turn only
            return _unpacked(shape, solve(x[rows], inst[rows], p[rows], weight[rows]))  # noqa: B023

        K, kink, shift = again(np.ones(groups.size, dtype=np.bool_))
        std = jackknife(groups, again)
        if shape in ("full", "one way") and not dead + kink > std[1] and not (shape == "one way" and kink < -std[1]):
            shape, with_zone = ("shift" if both else "origin"), float(K)
            continue  # no dead zone that shows; without it the gain is better known
        if with_zone is not None:  # half of what that choice changes is doubt about it
            std[0] = float(np.hypot(std[0], 0.5 * (K - with_zone)))
        full = np.zeros(w.y.size)
        full[use] = agree
        return _Map(float(K), float(kink), float(shift), full, shape, std, spread > _SPREAD_OF_SPEED)


def _lag(cuts: Cuts, dead: float, start: float, allowed: list[int]) -> Estimate:
    """τ by the smallest misfit within the windows of the allowed missions; those whose speed changes decide."""
    step = max(r.dt for r in cuts.records)

    def sums(tau: float) -> tuple[Array, NDArray[np.int64]]:
        w = cuts.windows(dead, tau)
        mine = np.isin(w.mission, allowed) & ~w.frozen & w.changing
        return np.column_stack([w.yy[mine], w.yp[mine], w.pp[mine]]), w.group[mine]

    def misfit(total: Array) -> Array:  # of columns yy, yp, pp
        return np.asarray(1.0 - total[..., 1] ** 2 / np.maximum(total[..., 0] * total[..., 2], 1e-300))

    def minimum(taus: Array, totals: Array) -> float:
        m = misfit(totals)
        k = int(np.clip(np.argmin(m), 1, taus.size - 2))
        x = np.log(taus[k - 1 : k + 2])
        c = np.polyfit(x - x[1], m[k - 1 : k + 2], 2)
        shift = -c[1] / (2 * c[0]) if c[0] > 0 else 0.0
        return float(np.exp(x[1] + np.clip(shift, x[0] - x[1], x[2] - x[1])))

    taus = _TAUS[step <= _TAUS]
    cells = [sums(t)[0] for t in taus]
    if len(cells[0]) < 3:
        return Estimate(start, float("nan"), "the commanded speed never changes while driving")
    table = np.array([c.sum(axis=0) for c in cells])
    fine = max(minimum(taus, table), step / 0.7) * np.geomspace(
        0.7, 1 / 0.7, 7
    )  # a shorter one than a step does not show
    groups = sums(float(fine[0]))[1]
    stack = np.array([sums(float(t))[0] for t in fine])  # (taus, windows, 3)
    tau = minimum(fine, stack.sum(axis=1))
    best = float(misfit(stack.sum(axis=1)).min())
    std = float(jackknife(groups, lambda mask: np.array([minimum(fine, stack[:, mask].sum(axis=1))]))[0])
    if best > 0.5 or float(misfit(table).max()) < 1.02 * best:
        why = f"the best lag explains {100 * (1 - best):.0f} % of the changes of speed only"
        return Estimate(start, float("nan"), why)
    unresolved = 0.5 * step if tau < _RESOLVED * step else 0.0
    return Estimate(tau, float(np.hypot(np.hypot(std, _LAG_DOUBT * tau), unresolved)))


def fit_wheel(records: list[WheelRecord], start_tau: float) -> WheelFit:
    """Fit one wheel's constants to healthy missions; windows and missions that disagree are left out.

    Parameters
    ----------
    records : list[WheelRecord]
        The wheel in each mission.
    start_tau : float
        Lag to begin with, and to keep where the missions do not show it [s].
    """
    dead, tau = 0.0, Estimate(start_tau, float("nan"))
    cuts, allowed = Cuts(records), list(range(len(records)))
    left: list[int] = []
    for _ in range(3):
        for _ in range(4):
            w = cuts.windows(dead, tau.value)
            found = _effort_map(w, np.isin(w.mission, allowed), dead)
            if found is None:
                return _refused(f"fewer than {_LEAST_WINDOWS} steady windows of {WINDOW_S:g} s under command", w)
            step = max(dead + found.kink, 0.0) - dead if found.shape in ("full", "one way") else -dead
            dead += step
            if abs(step) < 1e-3 * float(np.median(np.abs(w.p))):
                break
        assert found is not None
        odd = _odd_missions(w, found, allowed)
        left += odd
        allowed = [m for m in allowed if m not in odd]
        tau = _lag(cuts, dead, tau.value, allowed)
    assert found is not None
    if len(left) > len(records) / 2:
        return _refused("most missions disagree with each other", w)
    steady = int(np.count_nonzero(w.steady & np.isin(w.mission, allowed)))
    share = 1 - np.count_nonzero(found.weight) / max(1, steady)
    if share > _MAX_LEFT_OUT:
        refused = _refused(
            f"{100 * share:.0f} % of its {steady} steady windows disagree with the rest (limit "
            f"{100 * _MAX_LEFT_OUT:.0f} %): it may have been faulty; use missions in which it was healthy",
            w,
        )
        return replace(refused, left_share=float(share))
    if found.K <= 0:
        return _refused("speed falls with opening: the sign of its speed or of its opening is wrong", w)
    return _finished(w, found, dead, tau, left, steady)


def _finished(w: Windows, found: _Map, dead: float, tau: Estimate, left: list[int], steady: int) -> WheelFit:
    K = found.K
    out = w.steady & (found.weight == 0)
    K_std, kink_std, shift_std = (float(x) for x in found.std)
    one_way = "driven one way only: an offset cannot be distinguished from the dead zone, which contains it"
    offset, zone = Estimate(-found.shift * K, shift_std * K), Estimate(dead, kink_std)
    if found.shape == "one way" and dead == 0.0 and found.kink < 0:
        zone = Estimate(0.0, float("nan"), "driven one way only: the offset contains it")
        offset = Estimate(-found.kink * K * float(np.sign(np.median(w.z))), kink_std * K)
    elif found.shape in ("one way", "origin"):
        offset = Estimate(0.0, float("nan"), one_way)
    if found.shape in ("shift", "origin"):
        zone = Estimate(
            0.0,
            float("nan"),
            "none found" if found.speeds else "driven at one speed only: the gain holds there and contains it",
        )
    return WheelFit(
        Estimate(K, K_std),
        tau,
        zone,
        offset,
        found.weight,
        w.group,
        steady,
        tuple(sorted(set(w.mission[found.weight > 0].tolist()))),
        tuple(sorted(left)),
        odd=tuple(zip(w.mission[out].tolist(), w.place[out].tolist(), strict=True)),
        left_share=1.0 - np.count_nonzero(found.weight) / max(1, steady),
    )


def _odd_missions(w: Windows, found: _Map, allowed: list[int]) -> list[int]:
    """Missions whose median window lies far from the others'."""
    expected = w.y / found.K + found.kink * np.sign(w.z) + found.shift
    relative = (w.p - expected) / np.maximum(np.abs(expected), 1e-12)
    use = w.steady & ~w.frozen
    known = [m for m in allowed if np.any(use & (w.mission == m))]
    if len(known) < 3:
        return []
    centres = np.array([np.median(relative[use & (w.mission == m)]) for m in known])
    middle = float(np.median(centres))
    limit = max(_CUT_MISSION * 1.4826 * float(np.median(np.abs(centres - middle))), _MISSION_LIMIT)
    return [m for m, c in zip(known, centres, strict=True) if abs(c - middle) > limit]


def _refused(why: str, w: Windows) -> WheelFit:
    nothing = Estimate(float("nan"), float("nan"), why)
    none = np.zeros(w.y.size)
    steady = int(np.count_nonzero(w.steady))
    return WheelFit(nothing, nothing, nothing, nothing, none, w.group, steady, (), (), why)
