"""What a machine file says of a steering axle's valve, cylinder and sensor."""

from __future__ import annotations

from dataclasses import dataclass, fields

from replay.errors import check_range


@dataclass(frozen=True)
class AxlePlant:
    """Steering axle: rate = slope·(|u| − dead) up to the limit, of either sign, with a lag; the sensor has a play.

    Attributes
    ----------
    slope_up, slope_down : float
        Rate per opening beyond the dead band, of positive and of negative openings [rad/s].
    dead_up, dead_down : float
        Opening that gives no motion [fraction].
    lag : float
        Lag [s].
    play : float
        Half of the sensor's play [rad].
    limit_up, limit_down : float or None
        Largest rate [rad/s]; None where no opening has shown it.
    misfit : float
        Share of a rate that this leaves unexplained [1].
    seen_up, seen_down : float
        Largest opening of each sign that the axle was seen to obey [fraction].
    slope_up_std, slope_down_std, dead_up_std, dead_down_std, lag_std, play_std : float
        Standard deviations, same units.
    """

    slope_up: float
    slope_down: float
    dead_up: float
    dead_down: float
    lag: float
    play: float
    limit_up: float | None = None
    limit_down: float | None = None
    misfit: float = 0.05
    seen_up: float = 0.0
    seen_down: float = 0.0
    slope_up_std: float = 0.0
    slope_down_std: float = 0.0
    dead_up_std: float = 0.0
    dead_down_std: float = 0.0
    lag_std: float = 0.0
    play_std: float = 0.0

    def __post_init__(self) -> None:
        """Check values."""
        for f in fields(self):
            value = getattr(self, f.name)
            if value is None:
                continue
            positive = f.name in ("slope_up", "slope_down", "lag", "limit_up", "limit_down")
            check_range(f"steering.{f.name}", value, 1e-6 if positive else 0.0, 1e6, "")
