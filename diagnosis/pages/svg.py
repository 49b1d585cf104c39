"""Pieces of pictures that need no JavaScript: symbols of modes and states, and text."""

from __future__ import annotations

from markupsafe import Markup, escape

from diagnosis.results.fault_rows import LOOKS

_LINE = 'fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round"'
#: Symbol of what is no state.
_WARNING = f'<path d="M6 2v4.6M6 9.6v.2" {_LINE}/>'
_UNKNOWN = f'<path d="M3.6 4a2.4 2.2 0 1 1 3.4 2c-.8.4-1 .8-1 1.4M6 10v.1" {_LINE}/>'


def _glyph(state: str) -> Markup:
    look = LOOKS.get(state)
    shape = _WARNING if state == "warning" else "" if look is None else look.glyph
    return Markup(shape or _UNKNOWN)


def icon(state: str) -> Markup:
    """Symbol of a state for running text; decoration only, its words stand beside it."""
    shape = '<span class="ic {}" aria-hidden="true"><svg viewBox="0 0 12 12">{}</svg></span>'
    return Markup(shape).format(state, _glyph(state))


def badge(state: str, x: float, y: float, size: float) -> Markup:
    """Symbol of a state inside another picture, centred at (x, y). All in px."""
    inner = size * 0.6 / 12
    return Markup(
        '<g class="bg {}" transform="translate({:.1f},{:.1f})"><rect width="{:.1f}" height="{:.1f}" rx="{:.1f}"/>'
        '<g class="gl" transform="translate({:.1f},{:.1f}) scale({:.2f})">{}</g></g>'
    ).format(state, x - size / 2, y - size / 2, size, size, size / 4, size * 0.2, size * 0.2, inner, _glyph(state))


def text(x: float, y: float, words: str, style: str) -> Markup:
    """Text inside a picture; `words` may come from a log. Places in px."""
    return Markup('<text x="{:.1f}" y="{:.1f}" class="{}">{}</text>').format(x, y, style, escape(words))
