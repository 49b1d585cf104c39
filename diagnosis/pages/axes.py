"""Axes of the small pictures: a rectangle with ticks, and the way from values to places."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

from diagnosis.pages.labels import number

_LEFT, _BOTTOM = 46.0, 21.0
_LETTER = 6.0  # mean width of a tick's letters


@dataclass(frozen=True)
class Frame:
    """Rectangle of a picture: size of the picture, values at the borders, room at the right and above."""

    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    margin: float = 8.0
    top: float = 6.0

    @property
    def left(self) -> float:
        """Place of the left border. In px."""
        return _LEFT

    @property
    def right(self) -> float:
        """Place of the right border. In px."""
        return self.width - self.margin

    @property
    def bottom(self) -> float:
        """Place of the lower border. In px."""
        return self.height - _BOTTOM

    def px(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Places of times. Both of shape (k,): times in s, places in px."""
        share = (np.asarray(x) - self.x[0]) / (self.x[1] - self.x[0])
        return self.left + share * (self.right - self.left)

    def py(self, y: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Places of values; those outside stand at the border. Both of shape (k,), places in px."""
        share = (np.asarray(y) - self.y[0]) / (self.y[1] - self.y[0])
        return self.bottom - np.clip(share, 0.0, 1.0) * (self.bottom - self.top)

    def axes(self, unit: str, scale: float = 1.0, *, percent: bool = False) -> Markup:
        """Grid, ticks and their words; `scale` is the factor of the times shown, `unit` their unit."""
        parts = ['<path class="grid" d="']
        xs, ys = ticks(self.x[0] * scale, self.x[1] * scale, 5), ticks(*self.y, 4)
        down, across = [float(self.px(v / scale)) for v in xs], [float(self.py(v)) for v in ys]
        parts += [f"M{p:.1f} {self.top:.1f}V{self.bottom:.1f}" for p in down]
        parts += [f"M{self.left:.1f} {p:.1f}H{self.right:.1f}" for p in across]
        parts.append('"/>')
        for k, (p, v) in enumerate(zip(down, xs, strict=True)):
            words = number(v, 6) + (f" {unit}" if k == len(xs) - 1 else "")
            cut = p + _LETTER * len(words) / 2 > self.width
            parts.append(label(self.width if cut else p, self.bottom + 14, words, "fin" if cut else "mid"))
        parts += [
            label(self.left - 5, p + 3.5, f"{number(100 * v, 6)} %" if percent else number(v, 6), "fin")
            for p, v in zip(across, ys, strict=True)
        ]
        return Markup("".join(parts))

    def line(self, x: float, style: str) -> Markup:
        """Upright line at a time. Time in s."""
        shape = '<path class="{}" d="M{:.1f} {:.1f}V{:.1f}"/>'
        return Markup(shape).format(style, float(self.px(x)), self.top, self.bottom)

    def shade(self, a: float, b: float, style: str) -> Markup:
        """Part of the time in the colour of a mode. Times in s."""
        x0, x1 = (min(self.right, max(self.left, float(self.px(v)))) for v in (a, b))
        return Markup('<rect class="f {}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>').format(
            style, x0, self.top, max(1.0, x1 - x0), self.bottom - self.top
        )


_CONSTANT, _ROUNDING = 0.01, 1e-9  # of a level: room about one value, and what no axis can resolve


def ticks(low: float, high: float, most: int) -> list[float]:
    """At most `most` round values between two. In the unit of the axis."""
    rough = (high - low) / most
    if not rough > 0:
        return [low]
    power = 10.0 ** math.floor(math.log10(rough))
    step = next((m * power for m in (1, 2, 2.5, 5, 10) if m * power >= rough * 0.999), 10 * power)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def limits(*series: NDArray[np.float64], least: float = 0.0) -> tuple[float, float] | None:
    """Range that holds all finite values with a margin, at least `least` high; None where there is none.

    In the unit of the series; NaN are left out.
    """
    finite = [s[np.isfinite(s)] for s in series]
    values = np.concatenate(finite) if finite else np.zeros(0)
    if not values.size:
        return None
    low, high = float(values.min()), float(values.max())
    level = max(1.0, abs(low), abs(high)) * (_CONSTANT if high == low else _ROUNDING)
    extra = max(0.08 * (high - low), 0.5 * (least - (high - low)), level)
    return low - extra, high + extra


def label(x: float, y: float, words: str, style: str) -> Markup:
    """Text of a picture; `words` may come from a log. Places in px."""
    return Markup(f'<text x="{x:.1f}" y="{y:.1f}" class="{style}">{escape(words)}</text>')
