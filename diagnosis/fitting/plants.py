"""Wheel constants of a whole machine: what its wheels share, and how each differs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.fitting.robust import Estimate, equal_weights, jackknife
from diagnosis.fitting.wheels import WheelFit, fit_wheel
from diagnosis.fitting.windows import WheelRecord, fed, window_length

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LEAST_WHEELS = 3
_ODD_WHEEL = 0.25
_SURE = 3.0  # standard deviations by which a gain is odd
_ALSO_LEFT = 0.1  # share of the other wheels' windows left out from which a wheel's own is no sign of a fault
_UNSURE_GAIN = 0.5  # standard deviation of a gain, as a share, from which it is not written
_START_TAU = 0.25
_LOAD_S = 0.5
_LEAST_PARTS = 10
_CUT = 4.0


def fit_plants(missions: list[list[WheelRecord | None]], flow: float | None) -> list[WheelFit | None]:
    """Fit every wheel of a machine.

    Under tyre grip the wheels push each other: a wheel's own effort map is bent by its command, the mean over all
    wheels is not. So the mean wheel gives gain and dead zone, and each wheel its ratio to the others.

    Parameters
    ----------
    missions : list[list[WheelRecord or None]]
        Per mission every wheel in the machine's order; None where it is not logged.
    flow : float or None
        Sum of speeds that the pump can feed [m/s].

    Returns
    -------
    list[WheelFit or None]
        Per wheel; None where no mission logs it.
    """
    fits = _each(missions)
    if flow is not None and any(f is not None and not f.refused for f in fits):
        fits = _each([_fed_by_pump(m, fits, flow) for m in missions])
    fits = _without_odd_wheels(_blamed_on_the_model(fits))
    fits = _without_unsure_wheels(_shared(missions, fits))
    return [None if f is None else _with_load(f, [m[i] for m in missions]) for i, f in enumerate(fits)]


def _shared(missions: list[list[WheelRecord | None]], fits: list[WheelFit | None]) -> list[WheelFit | None]:
    """Constants from the mean wheel where there are enough wheels to cancel their forces on each other."""
    good = [i for i, f in enumerate(fits) if f is not None and not f.refused]
    if len(good) < _LEAST_WHEELS:
        return fits
    odd = {place for i in good for place in _of(fits, i).odd}
    means = [_mean_wheel([wheels[i] for i in good], [k for n, k in odd if n == m]) for m, wheels in enumerate(missions)]
    tau = float(np.median([_of(fits, i).tau.value for i in good]))
    shared = fit_wheel([m for m in means if m is not None], tau) if any(m is not None for m in means) else None
    if shared is None or shared.refused:
        return fits
    gain = float(np.mean([_of(fits, i).K.value for i in good]))
    zone = float(np.mean([_of(fits, i).dead.value for i in good]))
    for i in good:
        fits[i] = _placed(_of(fits, i), shared, gain, zone)
    return fits


def _of(fits: list[WheelFit | None], i: int) -> WheelFit:
    fit = fits[i]
    assert fit is not None
    return fit


def _each(missions: list[list[WheelRecord | None]]) -> list[WheelFit | None]:
    out: list[WheelFit | None] = []
    for i in range(len(missions[0])):
        logged = [m for m, wheels in enumerate(missions) if wheels[i] is not None]
        records = [r for wheels in missions if (r := wheels[i]) is not None]
        fit = fit_wheel(records, _START_TAU) if records else None
        if fit is not None:  # missions by their place in the whole list
            fit = replace(
                fit,
                missions=tuple(logged[m] for m in fit.missions),
                left_missions=tuple(logged[m] for m in fit.left_missions),
                odd=tuple((logged[m], k) for m, k in fit.odd),
            )
        out.append(fit)
    return out


def _fed_by_pump(
    wheels: list[WheelRecord | None], fits: list[WheelFit | None], flow: float
) -> list[WheelRecord | None]:
    """Leave out what follows within three lags on a demand that the pump cannot feed."""
    known = [f for f in fits if f is not None and not f.refused]
    logged = [r for r in wheels if r is not None]
    if not known or not logged:
        return wheels
    gain = float(np.median([f.K.value for f in known]))
    dead = float(np.median([f.dead.value for f in known]))
    lag = max(f.tau.value for f in known)
    demand = sum(gain * np.maximum(np.abs(np.nan_to_num(r.u[:, 0])) - dead, 0.0) for r in logged)
    steps = np.arange(logged[0].y.size)
    last = np.maximum.accumulate(np.where(np.asarray(demand) > flow, steps, -(10**9)))
    free = steps - last > 3 * lag / logged[0].dt
    return [None if r is None else replace(r, use=r.use & free) for r in wheels]


def _blamed_on_the_model(fits: list[WheelFit | None]) -> list[WheelFit | None]:
    """Say of wheels whose windows contradict each other that no map holds, where those of the others do so too."""
    known = [f for f in fits if f is not None]
    left = [f.left_share for f in known]
    out: list[WheelFit | None] = []
    for f in fits:
        if f is not None and f.refused and f.left_share > 0.0 and len(known) >= _LEAST_WHEELS:
            others = float(np.median([x for x, g in zip(left, known, strict=True) if g is not f]))
            if others > _ALSO_LEFT:
                text = (
                    f"{100 * f.left_share:.0f} % of its {f.considered} steady windows disagree with the rest, and {100 * others:.0f} % "
                    "of the other wheels' with theirs: no map from opening to speed holds for these drives"
                )
                f = _refused_for(f, text)
        out.append(f)
    return out


def _without_unsure_wheels(fits: list[WheelFit | None]) -> list[WheelFit | None]:
    """Refuse gains whose standard deviation leaves them open."""
    return [
        f
        if f is None or f.refused or f.K.std <= _UNSURE_GAIN * f.K.value
        else _refused_for(f, f"too uncertain: a gain of {f.K.value:.3g} ± {f.K.std:.2g} m/s per full opening")
        for f in fits
    ]


def _refused_for(fit: WheelFit, why: str) -> WheelFit:
    return replace(fit, refused=why)


def _without_odd_wheels(fits: list[WheelFit | None]) -> list[WheelFit | None]:
    """Refuse wheels whose gain lies surely far from that of most others.

    Far is beyond what the standard deviations and the scatter of the others leave open: where no map holds, all gains
    scatter, and none of the wheels is to blame. A wheel that alone is uncertain is.
    """
    gains = [f.K.value for f in fits if f is not None and not f.refused]
    if len(gains) < _LEAST_WHEELS:
        return fits
    middle = float(np.median(gains))
    out: list[WheelFit | None] = []
    for f in fits:
        if f is None or f.refused:
            out.append(f)
            continue
        others = [g.K for g in fits if g is not None and not g.refused and g is not f]
        apart = float(np.std([k.value for k in others], ddof=1))
        usual = float(np.median([k.std for k in others if np.isfinite(k.std)] or [0.0]))
        doubt = _SURE * float(np.sqrt(np.nansum(np.square([min(f.K.std, 2 * usual), apart, usual]))))
        if abs(f.K.value - middle) > max(_ODD_WHEEL * middle, doubt):
            text = (
                f"its gain of {f.K.value:.3g} m/s per full opening disagrees with the other wheels' {middle:.3g}: a "
                "fault in all missions, or a wrong unit or gain of its signals"
            )
            f = _refused_for(f, text)
        out.append(f)
    return out


def _mean_wheel(wheels: list[WheelRecord | None], odd: list[int]) -> WheelRecord | None:
    """Mean of all wheels of a mission as one record, without windows in which one is odd; None where one is not logged."""
    known = [r for r in wheels if r is not None]
    if len(known) < len(wheels):
        return None
    use = np.logical_and.reduce([r.use for r in known])
    length = window_length(known[0].dt)
    for k in odd:
        use[k * length : (k + 1) * length] = False
    signs = np.abs(np.sum([np.sign(r.command) for r in known], axis=0))
    command = np.mean([r.command for r in known], axis=0)
    return replace(
        known[0],
        y=np.mean([r.y for r in known], axis=0),
        u=np.column_stack([r.u for r in known]),
        command=np.where(signs == len(known), command, np.where(np.abs(command) < known[0].driving, command, np.nan)),
        use=use,
    )


def _placed(own: WheelFit, shared: WheelFit, gain: float, zone: float) -> WheelFit:
    """A wheel's constants: those of the mean wheel, times the wheel's own ratio to the others."""
    K = shared.K.value * own.K.value / gain
    spread = np.hypot(shared.K.std / shared.K.value, own.K.std / own.K.value)
    dead = max(0.0, shared.dead.value + own.dead.value - zone)
    dead_std = float(np.hypot(np.nan_to_num(shared.dead.std), np.nan_to_num(own.dead.std)))
    why = shared.dead.why if dead == 0.0 else ""
    return replace(
        own,
        K=Estimate(float(K), float(spread * K)),
        dead=Estimate(dead, dead_std if dead > 0 else float("nan"), why),
    )


def _with_load(fit: WheelFit, records: list[WheelRecord | None]) -> WheelFit:
    """Add the standard deviation of y − K·p − offset in healthy driving, its quick part averaged away."""
    if fit.refused:
        return fit
    slow, mission = [], []
    for m in fit.missions:
        r = records[m]
        assert r is not None
        length = max(1, round(_LOAD_S / r.dt))
        model = fit.K.value * fed(r, fit.dead.value, fit.tau.value) + fit.offset.value
        good = r.use & (np.abs(r.command) > r.driving)
        left = np.where(good, r.y - model, np.nan)[: r.y.size // length * length].reshape(-1, length)
        means = left.mean(axis=1)  # NaN where a sample is not usable
        means = means[np.isfinite(means)]
        slow.append(means)
        mission.append(np.full(means.size, m))
    x, group = np.concatenate(slow), np.concatenate(mission)
    if x.size < _LEAST_PARTS:
        return replace(fit, load=Estimate(float("nan"), float("nan"), "too little driving"))
    centre = float(np.median(x))
    kept = np.abs(x - centre) <= _CUT * 1.4826 * max(float(np.median(np.abs(x - centre))), 1e-12)
    x, group = x[kept], group[kept]
    weight = equal_weights(group, _LEAST_PARTS)
    parts = group if len(fit.missions) >= 4 else np.arange(x.size) * 10 // x.size

    def size(mask: Mask) -> Array:
        return np.array([np.sqrt(np.average(x[mask] ** 2, weights=weight[mask]))])

    value = float(size(np.ones(x.size, dtype=np.bool_))[0])
    return replace(fit, load=Estimate(value, float(jackknife(parts, size)[0])))
