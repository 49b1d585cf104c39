"""The timeline of a mission as a figure: one lane for each side of a component, its states and faults."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from diagnosis.api.figure_style import MARGIN_PX, colour_of, finish, inert
from diagnosis.results.fault_rows import LOOKS, state_label
from diagnosis.results.machine_words import MachineWords
from replay.faults import FaultMode

if TYPE_CHECKING:
    import plotly.graph_objects as go

_LANE_PX = 26


def timeline_figure(
    lanes: Iterable[tuple[str, str, str]],
    spans: Sequence[tuple[str, str, str, float, float, str]],
    title: str,
    words: MachineWords,
) -> go.Figure:
    """States of every part over the mission, one lane for each side of a component.

    Parameters
    ----------
    lanes : Iterable[tuple[str, str, str]]
        Component, kind and side of each lane, from the top.
    spans : Sequence[tuple[str, str, str, float, float, str]]
        Component, side, state, begin and end [s], and what is said of it.
    title : str
        Heading.
    words : MachineWords
        How to speak of the machine.
    """
    import plotly.graph_objects as go

    names = {(component, side): inert(words.part_words(kind, component, side)) for component, kind, side in lanes}
    figure = go.Figure()
    for state in dict.fromkeys((*LOOKS, *(span[2] for span in spans))):
        mine = [span for span in spans if span[2] == state and (span[0], span[1]) in names]
        if not mine:
            continue
        figure.add_bar(
            orientation="h", name=state_label(state), marker={"color": colour_of(state), "line": {"width": 0}},
            y=[names[span[0], span[1]] for span in mine], base=[span[3] for span in mine],
            x=[span[4] - span[3] for span in mine], text=[_fault_named(span[5], state) for span in mine], customdata=[[span[3], span[4], inert(span[5])] for span in mine],
            hovertemplate="%{y}<br>" + state_label(state) + ": %{customdata[0]:.3f} to %{customdata[1]:.3f} s<br>"
            "%{customdata[2]}<extra></extra>",
        )  # fmt: skip
    finish(figure, inert(title), _LANE_PX * len(names) + MARGIN_PX)
    figure.update_layout(barmode="overlay", hovermode="closest", bargap=0.25)
    figure.update_yaxes(categoryorder="array", categoryarray=list(names.values())[::-1], automargin=True)
    figure.update_xaxes(title_text="mission time (s)")
    return figure


def _fault_named(words: str, state: str) -> str:
    """Name at the beginning of what is said of a fault: ``F1``; empty for other states."""
    return words.partition(":")[0] if ":" in words and state in list(FaultMode) else ""
