"""Which curves of a clip show its fault: measurement, residual, valve command, probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnosis.results.document import IntervalRow
from diagnosis.results.vocabulary import Kind
from replay.export.clips.topics import EVIDENCE, MAPPED
from replay.export.clips.viewer_layouts import Curve, Plot
from replay.faults import DECIDED, Side

_NAMED = (MAPPED, EVIDENCE)


@dataclass(frozen=True)
class _Clip:
    """Curves of one component that a clip holds; each method gives one, or nothing.

    Attributes
    ----------
    component, kind : str, Kind
        Component, and what it is.
    named : Mapping[str, tuple[str, int]]
        Topic and place of each mapped signal and each evidence series.
    loop : Mapping[str, Sequence[str]]
        Components by topic of the replayed loop.
    """

    component: str
    kind: Kind
    named: Mapping[str, tuple[str, int]]
    loop: Mapping[str, Sequence[str]]

    def signal(self, leaf: str, label: str) -> list[Curve]:
        """A mapped signal of the component."""
        return self._curve(f"{self.kind}.{self.component}.{leaf}", label)

    def evidence(self, side: Side, leaf: str, label: str) -> list[Curve]:
        """An evidence series of one of its sides."""
        return self._curve(f"{self.component}.{side}.{leaf}", label)

    def replayed(self, quantity: str, label: str) -> list[Curve]:
        """A quantity of the replayed loop."""
        topic = f"/mfhca/{'steer_' if self.kind == Kind.STEER else ''}{quantity}"
        names = list(self.loop.get(topic, ()))
        return [Curve(topic, names.index(self.component), self.component, label)] if self.component in names else []

    def _curve(self, name: str, label: str) -> list[Curve]:
        return [Curve(*self.named[name], name, label)] if name in self.named else []


def plots_of(fault: IntervalRow, topics: Sequence[tuple[str, Sequence[str]]]) -> list[Plot]:
    """Plots of a fault; what the clip does not hold is left out.

    Parameters
    ----------
    fault : IntervalRow
        Interval of a report.
    topics : Sequence[tuple[str, Sequence[str]]]
        JointState topics of the clip with their joint names.
    """
    component, sides = fault["component"], Side(fault["side"]).sides
    named = {name: (topic, i) for topic, names in topics if topic.startswith(_NAMED) for i, name in enumerate(names)}
    clip = _Clip(component, fault["kind"], named, dict(topics))
    plots = [
        _motion(clip, sides),
        *(_residual(clip, side) for side in sides),
        _valve(clip, sides),
        *(_probability(clip, side) for side in sides),
    ]
    return [p for p in plots if p.curves] or [Plot(component, ())]


def _motion(clip: _Clip, sides: Sequence[Side]) -> Plot:
    name, leaf, commanded = ("angle", "phi", "phi_ref") if clip.kind == Kind.STEER else ("speed", "v", "v_ref")
    curves = (
        *clip.signal(leaf, "measured"),
        *clip.signal(f"{leaf}_true", "second measurement"),
        *clip.replayed(commanded, "commanded"),
        *(clip.evidence(Side.SENSOR, "expected", "expected") if Side.SENSOR in sides else ()),
    )
    return Plot(f"{clip.component} {name}", curves)


def _residual(clip: _Clip, side: Side) -> Plot:
    curves = (
        *clip.evidence(side, "residual", "residual"),
        *clip.evidence(side, "threshold", "threshold"),
        *clip.evidence(side, "minus_threshold", "−threshold"),
    )
    return Plot(f"{clip.component} {side}: residual", curves)


def _valve(clip: _Clip, sides: Sequence[Side]) -> Plot:
    curves = (
        *clip.signal("u", "command recorded"),
        *clip.replayed("u_replayed", "command replayed"),
        *clip.signal("u_applied", "position measured"),
        *(clip.evidence(Side.ACTUATOR, "expected", "position expected") if Side.ACTUATOR in sides else ()),
    )
    return Plot(f"{clip.component} valve", curves)


def _probability(clip: _Clip, side: Side) -> Plot:
    curves = tuple(c for m in DECIDED for c in clip.evidence(side, f"p_{m}", m.replace("_", " ")))
    return Plot(f"{clip.component} {side}: probability", curves)
