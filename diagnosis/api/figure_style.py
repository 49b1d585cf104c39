"""How figures look: colours and dashes of the light page, words from logs made inert, sizes."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from diagnosis.pages.labels import visible
from diagnosis.results.fault_rows import LOOKS
from replay.faults import State

if TYPE_CHECKING:
    import plotly.graph_objects as go

#: Colours of the light page, see ``diagnosis/pages/style.css``.
COLOURS = {
    "text": "#17212b", "muted": "#536170", "accent": "#0a5a9c", "teal": "#00796b", "alt": "#a03080", "peer": "#8b97a4",
    "line2": "#e9edf1",
}  # fmt: skip
BAND = "rgba(10, 90, 156, 0.18)"
STUCK = LOOKS[State.STUCK].light
#: Colour, width and dash of a curve by the part that it plays, as in ``diagnosis/report/assets/figure_looks.js``.
STYLES = {
    "measured": (COLOURS["accent"], 1.7, "solid"),
    "commanded": (COLOURS["text"], 1.3, "dot"),
    "expected": (COLOURS["teal"], 1.5, "dash"),
    "reference": (COLOURS["text"], 1.0, "solid"),
    "replayed": (COLOURS["alt"], 1.5, "dash"),
    "applied": (COLOURS["teal"], 1.5, "solid"),
    "right": (COLOURS["muted"], 1.0, "dot"),
    "peer": (COLOURS["peer"], 1.1, "solid"),
    "threshold": (STUCK, 1.3, "dash"),
}
MARGIN_PX = 130
_QUIET = {
    State.NOT_EXCITED: "#d5dce3",
    State.MASKED: "#b9c3cd",
    State.SLIP: "#9cc0de",
    State.NO_DATA: "#f0f2f5",
    State.NOT_ASSESSED: "#e2e7ec",
}


def colour_of(state: str) -> str:
    """Colour of a mode or state on a light page."""
    return (LOOKS[state].light if state in LOOKS else "") or _QUIET.get(State(state), COLOURS["peer"])


def style_of(role: str) -> tuple[str, float, str]:
    """Colour, width and dash of the part that a curve plays: one of `STYLES`, or ``mode-`` and a mode."""
    if role.startswith("mode-"):
        mode = role.removeprefix("mode-")
        return colour_of(mode), 1.6, LOOKS[mode].dash if mode in LOOKS else "solid"
    return STYLES[role]


def inert(text: str) -> str:
    """Words that may come from a log, as a figure shows them verbatim."""
    return escape(visible(text), quote=False).replace("%{", "&#37;{")


def finish(figure: go.Figure, title: str, height: int) -> None:
    """Give a figure its heading, size [px], letters, and grid."""
    figure.update_layout(
        title={"text": title, "font": {"size": 16}}, height=height, hovermode="x unified", template="plotly_white",
        font={"color": COLOURS["text"], "size": 12}, margin={"l": 64, "r": 24, "t": 84, "b": 48},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "xanchor": "right", "x": 1.0},
    )  # fmt: skip
    figure.update_xaxes(gridcolor=COLOURS["line2"], zeroline=False)
    figure.update_yaxes(gridcolor=COLOURS["line2"], zerolinecolor=COLOURS["line2"])
