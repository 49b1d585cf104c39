"""How the drives of a mission answer to their commands, found in the mission itself: mixing, delay, lag and limits.

A faulty spell is not left out by hand: the misfit counts by its logarithm (Cauchy), so that what is far off has little to say.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.following import by_column, followed, target_of

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Array = NDArray[np.float64]

_LEAST_S = 20.0  # driving that a response can be found in
_DELAYS = (0.05, 0.3, 0.8)  # where the search begins [s]
_MOST_DELAY_S, _MOST_LAG_S = 2.5, 5.0
_TIMING_S = 0.4  # by which a transition may come earlier or later than expected
_MOSTLY, _MOSTLY_NOISE = 0.8, 1.3  # share of the driving that is sound, and its largest misfit there
_BOUND = 0.6  # of the largest command of a column: where the search for its limit begins
_LEAST_MISFIT = 0.15  # of a sample by the Cauchy misfit: below the plain response explains the driving
_EXPLAINS = 0.9  # of the misfit that is left: a limit of each column must explain so much
_USELESS = 1.0  # of what is expected: a usual misfit larger than that in a quarter of the driving leaves nothing to compare with
_UNEXPLAINED = 0.35  # of the usual speed: more misfit in half of the driving is no response at all


class Response(NamedTuple):
    """A drive's answer to its command.

    Attributes
    ----------
    weights : Array, shape (k,)
        Share of each command column in the target, the limit included.
    delay, lag : float
        Dead time and time constant [s].
    bounds : Array, shape (k,)
        Largest part of the target that each command column makes [m/s]: controllers limit how fast a body drives and how fast it turns
        each for itself. Infinite where nothing shows one.
    rates : Array, shape (k,)
        Largest acceleration by each command column [m/s²], likewise.
    limit, rate : float
        Largest speed [m/s] and acceleration [m/s²].
    low, high : Array, shape (cells,)
        Between what the speed is expected [m/s].
    noise : Array, shape (cells,)
        Usual misfit beyond that [m/s].
    expected : Array, shape (cells,)
        Expected speed [m/s].
    """

    weights: Array
    bounds: Array
    rates: Array
    delay: float
    lag: float
    limit: float
    rate: float
    low: Array
    high: Array
    noise: Array
    expected: Array

    @property
    def answered(self) -> bool:
        """Whether a command says what is expected."""
        return self.weights.size > 0

    def left(self, commands: Array) -> Array:
        """Weights of what bounds and limit leave of the target, shape (k,); of drives that are limited differently only these compare.

        Parameters
        ----------
        commands : Array, shape (cells, k)
            As for `identify_response`.
        """
        asked = np.nan_to_num(commands)
        target = target_of(asked, (self.weights, self.bounds), self.limit, 0.0)
        return np.asarray(np.linalg.lstsq(asked, target, rcond=None)[0], dtype=np.float64)

    def reach(self, commands: Array, cell: int, dt: float, size: int) -> tuple[Array, Array]:
        """Between what the commands could make of the speed around each step [m/s], at once or with the lag; both of shape (size,).

        Parameters
        ----------
        commands : Array, shape (cells, k)
            As for `identify_response`.
        cell, size : int
            Steps of a cell, and of the mission.
        dt : float
            Step [s].
        """
        h = cell * dt
        around = max(1, round(_TIMING_S / h))
        target = target_of(np.nan_to_num(commands), (self.weights, self.bounds), self.limit, self.delay / h)
        low = np.minimum(self.low, _moving(target, around, np.minimum)) - self.noise
        high = np.maximum(self.high, _moving(target, around, np.maximum)) + self.noise
        return np.repeat(low, cell)[:size], np.repeat(high, cell)[:size]


def without_command(size: int) -> Response:
    """What is expected of a drive whose command is not logged: any speed."""
    wide, nothing = np.full(size, np.inf), np.full(size, np.nan)
    return Response(
        np.zeros(0), np.zeros(0), np.zeros(0), np.nan, np.nan, np.nan, np.nan, -wide, wide, np.ones(size), nothing
    )


def identify_response(y: Array, commands: Array, h: float, driving_speed: float) -> Response | None:
    """The response of one drive; None where it drives too little, or its commands explain nothing.

    Parameters
    ----------
    y : Array, shape (cells,)
        Measured speed [m/s]; NaN where not known.
    commands : Array, shape (cells, k)
        What the target is put together from; NaN where not known.
    h : float
        Length of a cell [s].
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    """
    from scipy.optimize import least_squares

    asked = np.nan_to_num(commands)
    known = np.isfinite(y) & np.isfinite(commands).all(axis=1)
    driving = known & ((np.abs(asked).max(axis=1) > driving_speed) | (np.abs(np.nan_to_num(y)) > driving_speed))
    if np.count_nonzero(driving) * h < _LEAST_S or np.ptp(asked[driving], axis=0).max(initial=0.0) <= driving_speed:
        return None
    some = np.flatnonzero(driving)
    seen = y[some]
    usual = float(np.median(np.abs(seen)))
    if usual <= 0.2 * driving_speed:
        return None
    top = float(np.quantile(np.abs(seen), 0.99))
    size = np.maximum(np.abs(asked).max(axis=0), 1e-9)

    columns = asked.shape[1]

    def parts(x: Array) -> tuple[Array, Array, Array]:
        own = np.exp(x[columns + 4 :]) if x.size > columns + 4 else np.full(2 * columns, np.inf)
        return x[:columns] / size * top, own[:columns], own[columns:]

    def speed(x: Array) -> Array:
        limit, delay, lag, rate = x[columns : columns + 4]
        return followed(asked, parts(x), float(np.exp(limit)), delay / h, (float(np.exp(lag)), float(np.exp(rate))), h)

    scale = max(0.1 * usual, 1e-6)

    def misfit(x: Array) -> Array:
        return np.asarray((speed(x)[some] - seen) / scale)

    least = [-8.0] * asked.shape[1] + [np.log(0.3 * top), 0.0, np.log(h / 3), np.log(0.05 * top)]
    most = [8.0] * asked.shape[1] + [np.log(3.0 * top), _MOST_DELAY_S, np.log(_MOST_LAG_S), np.log(50.0 * top)]
    best = None
    for delay in _DELAYS:
        weights = _first_weights(y, asked, known, round(delay / h)) * size / top
        first = np.clip([*weights, np.log(1.05 * top), delay, np.log(0.4), np.log(2.0 * top)], least, most)
        found = least_squares(
            misfit,
            first,
            bounds=(least, most),
            loss="cauchy",
            diff_step=0.02,
            max_nfev=25,
        )
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    if columns > 1 and best.cost > _LEAST_MISFIT * some.size:
        bounded = _bounded(misfit, best, asked, parts(best.x)[0], (least, most))
        best = best if bounded is None else bounded
    expected = speed(best.x)
    if float(np.median(np.abs(expected[some] - seen))) > _UNEXPLAINED * usual:
        return None
    reach = max(1, round(_TIMING_S / h))
    low, high = _moving(expected, reach, np.minimum), _moving(expected, reach, np.maximum)
    weights, bounds, rates = parts(best.x)
    limit, delay, lag, rate = best.x[columns : columns + 4]
    made = np.abs(expected)
    if np.isfinite(bounds).any():  # driving and turning may cancel each other, their errors do not
        gain = -np.expm1(-h / max(np.exp(lag), 1e-3))
        made = np.sqrt((by_column(asked, (weights, bounds, rates), delay / h, gain, h) ** 2).sum(axis=1))
    noise = _noise(y, expected, made, low, high, driving)
    if float(np.quantile(noise[some] / np.maximum(made[some], 0.2 * usual), 0.75)) > _USELESS:
        return None
    fastest = float(rates.sum()) if np.isfinite(bounds).any() else float(np.exp(rate))
    out = Response(
        weights,
        bounds,
        rates,
        float(delay),
        float(np.exp(lag)),
        float(np.exp(limit)),
        fastest,
        low,
        high,
        noise,
        expected,
    )
    # a larger weight than the limit needs changes nothing and is told by nothing
    return out if np.isfinite(bounds).any() else out._replace(weights=out.left(asked))


def _bounded(
    misfit: Callable[[Array], Array],
    plain: OptimizeResult,
    asked: Array,
    weights: Array,
    within: tuple[list[float], list[float]],
) -> OptimizeResult | None:
    """The fit with limits of each command column, begun from the one without; None where that explains hardly more."""
    from scipy.optimize import least_squares

    made = np.abs(asked * weights)
    most = np.maximum(made.max(axis=0), 1e-6)
    fast = np.full(most.size, plain.x[most.size + 3])
    least = [*within[0], *np.log(0.02 * most), *(fast - 3.0)], [*within[1], *np.log(1.5 * most), *(fast + 3.0)]
    first = np.clip([*plain.x, *np.log(_BOUND * most), *(fast - 0.7)], *least)
    best = least_squares(misfit, first, bounds=least, loss="cauchy", diff_step=0.02, max_nfev=40)
    return best if best.cost < _EXPLAINS * plain.cost else None


def as_another(response: Response, commands: Array, share: Array, h: float) -> Response:
    """What a drive would make of its commands if it answered as another one does.

    Parameters
    ----------
    response : Response
        Of the other drive.
    commands : Array, shape (cells, k)
        As for `identify_response`.
    share : Array, shape (k,)
        1, or -1 where a command has the other drive go the other way.
    h : float
        Length of a cell [s].
    """
    weights = response.weights * share
    parts, pace = (weights, response.bounds, response.rates), (response.lag, response.rate)
    expected = followed(np.nan_to_num(commands), parts, response.limit, response.delay / h, pace, h)
    reach = max(1, round(_TIMING_S / h))
    low, high = _moving(expected, reach, np.minimum), _moving(expected, reach, np.maximum)
    return response._replace(weights=weights, low=low, high=high, expected=expected)


def beyond(y: Array, low: Array, high: Array) -> Array:
    """How far values lie outside of a band; 0 within. Shape of y. All of shape (k,), in one unit."""
    return np.asarray(y - np.clip(y, low, high))


def _first_weights(y: Array, asked: Array, known: NDArray[np.bool_], delay: int) -> Array:
    """Weights of delayed commands by least squares, twice: the second time without what is far off."""
    moved = np.zeros_like(asked)
    moved[delay:] = asked[: asked.shape[0] - delay]
    use = known.copy()
    weights: Array = np.zeros(asked.shape[1])
    for _ in range(2):
        weights = np.asarray(np.linalg.lstsq(moved[use], y[use], rcond=None)[0], dtype=np.float64)
        off = np.abs(y - moved @ weights)
        use = known & (off <= np.nanquantile(off[known], 0.7))
    return np.asarray(weights)


def _moving(x: Array, reach: int, pick: np.ufunc) -> Array:
    """Smallest or largest of the cells within `reach`."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    return np.asarray((minimum_filter1d if pick is np.minimum else maximum_filter1d)(x, 2 * reach + 1, mode="nearest"))


def _noise(y: Array, expected: Array, made: Array, low: Array, high: Array, driving: NDArray[np.bool_]) -> Array:
    """Usual misfit: a floor, a share of the speed, or of what it is put together from (`made`), and a share of the change that is under way, by medians of the driving."""
    off = np.abs(beyond(y, low, high))
    change = high - low
    calm = driving & (change < 0.1 * np.quantile(made[driving], 0.9))
    calm = calm if np.count_nonzero(calm) > 100 else driving
    raw = np.abs(y - expected)
    floor = float(np.quantile(raw[calm], 0.5)) * 1.2
    share = float(np.quantile(raw[calm] / np.maximum(made[calm], 0.2 * np.median(made[calm])), 0.5))
    busy = driving & ~calm
    moving = (
        float(np.quantile(off[busy] / np.maximum(change[busy], 1e-9), 0.75)) if np.count_nonzero(busy) > 50 else 0.2
    )
    noise = np.sqrt((0.7 * floor) ** 2 + (share * made) ** 2 + (min(moving, 0.5) * change) ** 2)
    return np.asarray(noise * max(1.0, float(np.quantile((off / noise)[driving], _MOSTLY)) / _MOSTLY_NOISE))
