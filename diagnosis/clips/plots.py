"""Which curves of a clip show its fault: measurement, residual, valve command, probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from replay.export.clips.topics import EVIDENCE, MAPPED
from replay.export.clips.viewer_layouts import Curve, Plot
from replay.faults import FaultMode

_NAMED = (MAPPED, EVIDENCE)
_PROBABILITIES = ("healthy", *(m.value for m in FaultMode))


def plots_of(fault: Mapping[str, Any], topics: Sequence[tuple[str, Sequence[str]]]) -> list[Plot]:
    """Plots of a fault; what the clip does not hold is left out.

    Parameters
    ----------
    fault : Mapping[str, Any]
        Interval of a report.
    topics : Sequence[tuple[str, Sequence[str]]]
        JointState topics of the clip with their joint names.
    """
    component = str(fault["component"])
    steer = fault["kind"] == "steer"
    sides = ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (str(fault["side"]),)
    known = {name: (topic, i) for topic, names in topics if topic.startswith(_NAMED) for i, name in enumerate(names)}
    loop = {topic: list(names) for topic, names in topics}

    def signal(leaf: str, label: str) -> list[Curve]:
        name = f"{'steer' if steer else 'wheel'}.{component}.{leaf}"
        return [Curve(*known[name], name, label)] if name in known else []

    def evidence(side: str, leaf: str, label: str) -> list[Curve]:
        name = f"{component}.{side}.{leaf}"
        return [Curve(*known[name], name, label)] if name in known else []

    def replayed(quantity: str, label: str) -> list[Curve]:
        topic = f"/mfhca/{'steer_' if steer else ''}{quantity}"
        names = loop.get(topic, [])
        return [Curve(topic, names.index(component), component, label)] if component in names else []

    what, second, commanded = ("angle", "phi", "phi_ref") if steer else ("speed", "v", "v_ref")
    plots = [
        Plot(
            f"{component} {what}",
            (
                *signal(second, "measured"),
                *signal(f"{second}_true", "second measurement"),
                *replayed(commanded, "commanded"),
                *(evidence("sensor", "expected", "expected") if "sensor" in sides else ()),
            ),
        ),
        *(
            Plot(
                f"{component} {side}: residual",
                (
                    *evidence(side, "residual", "residual"),
                    *evidence(side, "threshold", "threshold"),
                    *evidence(side, "minus_threshold", "−threshold"),
                ),
            )
            for side in sides
        ),
        Plot(
            f"{component} valve",
            (
                *signal("u", "command recorded"),
                *replayed("u_replayed", "command replayed"),
                *signal("u_applied", "position measured"),
                *(evidence("actuator", "expected", "position expected") if "actuator" in sides else ()),
            ),
        ),
        *(
            Plot(
                f"{component} {side}: probability",
                tuple(c for m in _PROBABILITIES for c in evidence(side, f"p_{m}", m.replace("_", " "))),
            )
            for side in sides
        ),
    ]
    shown = [p for p in plots if p.curves]
    return shown or [Plot(component, ())]
