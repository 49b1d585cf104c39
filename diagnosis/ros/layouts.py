"""Layouts that show a diagnosis: for Foxglove states over time, summary and events; for PlotJuggler levels, ε and p."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

from diagnosis.ros.messages import DIAGNOSTICS, EVENTS
from replay.export.clips.viewer_layouts import COLOURS, stacked

_TITLE = "mfhca diagnosis"
_SHOWN = ("level", "epsilon", "p")
# Between which each is drawn: a constant one has no range of its own; what gives more than it should has an ε below 0.
_LIMITS = {"level": (-0.1, 3.1), "epsilon": (-0.5, 1.05), "p": (-0.05, 1.05)}


def foxglove_diagnosis(parts: Sequence[str]) -> str:
    """State transitions of all parts above a summary of the moment and the list of events.

    Parameters
    ----------
    parts : Sequence[str]
        Names of the parts, in the order of each message's statuses.
    """
    panels: dict[str, Any] = {
        "StateTransitions!mfhca": {
            "foxglovePanelTitle": _TITLE,
            "isSynced": True,
            "paths": [
                {"value": f"{DIAGNOSTICS}.status[{i}].message", "label": name, "timestampMethod": "receiveTime"}
                for i, name in enumerate(parts)
            ],
        },
        "DiagnosticSummary!mfhca": {
            "minLevel": 0,
            "pinnedIds": [],
            "hardwareIdFilter": "",
            "topicToRender": DIAGNOSTICS,
            "sortByLevel": True,
            "secondsUntilStale": 5,
        },
        "RosOut!mfhca": {"topicToRender": EVENTS, "minLogLevel": 1, "searchTerms": [], "nameFilter": {}},
    }
    document = {
        "globalVariables": {},
        "configById": panels,
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": stacked(list(panels)),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def plotjuggler_diagnosis(hardware_id: str, parts: Mapping[str, Collection[str]]) -> str:
    """Level, ε̂ and probability of all parts, one area each.

    A curve that no status holds would be asked about when the layout is loaded, so it is left out, as is an empty area.

    Parameters
    ----------
    hardware_id : str
        That of the statuses.
    parts : Mapping[str, Collection[str]]
        Their names, with the keys that their statuses have.
    """
    shown = [key for key in _SHOWN if any(key in keys for keys in parts.values())]
    root = ElementTree.Element("root")
    window = ElementTree.SubElement(root, "tabbed_widget", {"name": "Main Window", "parent": "main_window"})
    tab = ElementTree.SubElement(window, "Tab", tab_name=_TITLE, containers="1")
    container = ElementTree.SubElement(tab, "Container")
    sizes = ";".join([f"{1 / len(shown):.6f}"] * len(shown))
    splitter = ElementTree.SubElement(container, "DockSplitter", orientation="-", count=str(len(shown)), sizes=sizes)
    for key in shown:
        area = ElementTree.SubElement(splitter, "DockArea", name=key)
        drawn = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Steps", flip_x="false", flip_y="false")
        for k, part in enumerate(parts):
            if key not in parts[part]:
                continue
            name = "/".join(filter(None, (DIAGNOSTICS, hardware_id, part, key)))
            ElementTree.SubElement(drawn, "curve", name=name, color=COLOURS[k % len(COLOURS)])
        low, high = _LIMITS[key]
        ElementTree.SubElement(drawn, "limitY", min=f"{low:g}", max=f"{high:g}")
    ElementTree.SubElement(window, "currentTabIndex", index="0")
    ElementTree.indent(root, " ")
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ElementTree.tostring(root, encoding="unicode") + "\n"
