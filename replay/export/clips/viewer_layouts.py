"""Layouts that open a clip's signals arranged: JSON for Foxglove, XML for PlotJuggler.

Compared with what both programs read: the parts of a layout and of a plot panel, message paths, and for PlotJuggler the
elements and attributes of tab, splitter, area and curve, and the names that it gives to joint states. Neither program has
opened one of these layouts in a test.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from replay.export.clips.mcap import MARK

COLOURS = ("#0a5a9c", "#e4571e", "#2fa98c", "#a03080", "#8b97a4", "#d99a00")


@dataclass(frozen=True)
class Curve:
    """One value of a JointState topic: its topic, place in ``position``, joint name, and what to call it."""

    topic: str
    index: int
    joint: str
    label: str


@dataclass(frozen=True)
class Plot:
    """Curves that share axes, with a title."""

    title: str
    curves: tuple[Curve, ...]


def foxglove_layout(title: str, plots: Sequence[Plot]) -> str:
    """Plots beneath each other, times linked."""
    panels: dict[str, Any] = {}
    for i, plot in enumerate(plots, 1):
        panels[f"Plot!clip{i}"] = {
            "foxglovePanelTitle": plot.title,
            "paths": [
                {
                    "value": f"{c.topic}.position[{c.index}]",
                    "label": c.label,
                    "enabled": True,
                    "timestampMethod": "receiveTime",
                    "color": COLOURS[k % len(COLOURS)],
                }
                for k, c in enumerate(plot.curves)
            ],
            "showXAxisLabels": True,
            "showYAxisLabels": True,
            "showLegend": True,
            "legendDisplay": "floating",
            "showPlotValuesInLegend": True,
            "isSynced": True,
            "xAxisVal": "timestamp",
            "sidebarDimension": 240,
        }
    document = {
        "globalVariables": {MARK: title},
        "configById": panels,
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": stacked(list(panels)),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def stacked(names: Sequence[str]) -> Any:
    """Panels of equal height: a tree that halves them off one after the other."""
    if len(names) == 1:
        return names[0]
    share = round(100 / len(names), 3)
    return {"first": names[0], "second": stacked(names[1:]), "direction": "column", "splitPercentage": share}


def plotjuggler_layout(title: str, plots: Sequence[Plot]) -> str:
    """Plots beneath each other in one tab."""
    root = ElementTree.Element("root")
    root.append(ElementTree.Comment(f" {MARK} "))
    window = ElementTree.SubElement(root, "tabbed_widget", {"name": "Main Window", "parent": "main_window"})
    tab = ElementTree.SubElement(window, "Tab", tab_name=title, containers="1")
    sizes = ";".join([f"{1 / len(plots):.6f}"] * len(plots))
    container = ElementTree.SubElement(tab, "Container")
    splitter = ElementTree.SubElement(container, "DockSplitter", orientation="-", count=str(len(plots)), sizes=sizes)
    for plot in plots:
        area = ElementTree.SubElement(splitter, "DockArea", name=plot.title)
        drawn = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false")
        for k, c in enumerate(plot.curves):
            name = f"{c.topic}/{c.joint}/position"
            ElementTree.SubElement(drawn, "curve", name=name, color=COLOURS[k % len(COLOURS)])
    ElementTree.SubElement(window, "currentTabIndex", index="0")
    ElementTree.indent(root, " ")
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ElementTree.tostring(root, encoding="unicode") + "\n"
