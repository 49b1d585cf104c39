"""Layouts have the parts that Foxglove and PlotJuggler ask for when they load one."""

from __future__ import annotations

import json
import re
from typing import Any
from xml.etree import ElementTree

import pytest

from replay.export.clips.viewer_layouts import Curve, Plot, foxglove_layout, plotjuggler_layout

PLOTS = [
    Plot(
        "FR speed", (Curve("/mfhca/mapped_1", 0, "wheel.FR.v", "measured"), Curve("/mfhca/v_ref", 2, "FR", "commanded"))
    ),
    Plot("FR sensor: residual", (Curve("/mfhca/evidence", 5, "FR.sensor.residual", "residual"),)),
    Plot("FR <valve> & more", ()),
]


def leaves(node: Any) -> list[str]:
    """Panels of a tree of halves, from the top."""
    if isinstance(node, str):
        return [node]
    assert set(node) == {"first", "second", "direction", "splitPercentage"}
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    return [*leaves(node["first"]), *leaves(node["second"])]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_foxglove_shows_every_panel_once(count: int) -> None:
    layout = json.loads(foxglove_layout("F1", PLOTS[:count]))
    assert {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"} <= set(layout)
    assert leaves(layout["layout"]) == list(layout["configById"])
    assert all(re.fullmatch(r"Plot!\w+", name) for name in layout["configById"]), "type of the panel before the mark"


def test_foxglove_paths_need_no_quotes() -> None:
    for panel in json.loads(foxglove_layout("F1", PLOTS))["configById"].values():
        assert panel["xAxisVal"] in ("timestamp", "index", "custom", "currentCustom")
        assert panel["legendDisplay"] in ("floating", "top", "left", "none")
        for path in panel["paths"]:
            assert re.fullmatch(r"(/\w+)+\.position\[\d+\]", path["value"])
            assert path["enabled"] is True
            assert path["timestampMethod"] in ("receiveTime", "headerStamp")
            assert re.fullmatch(r"#[0-9a-f]{6}", path["color"])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_plotjuggler_finds_as_many_areas_as_the_splitter_says(count: int) -> None:
    root = ElementTree.fromstring(plotjuggler_layout("F1 <FR>", PLOTS[:count]).encode())
    assert root.tag == "root"
    window = root.find("tabbed_widget")
    assert window is not None
    assert window.attrib == {"name": "Main Window", "parent": "main_window"}
    tab = window.find("Tab")
    assert tab is not None
    assert int(tab.attrib["containers"]) == len(tab.findall("Container")) == 1
    splitter = tab.find("Container/DockSplitter")
    assert splitter is not None
    assert splitter.attrib["orientation"] in ("-", "|")
    areas = list(splitter)
    assert [a.tag for a in areas] == ["DockArea"] * count
    assert int(splitter.attrib["count"]) == count
    sizes = [float(x) for x in splitter.attrib["sizes"].split(";")]
    assert len(sizes) == count
    assert sum(sizes) == pytest.approx(1.0, abs=1e-5)
    for area, plot in zip(areas, PLOTS, strict=False):
        assert area.attrib["name"] == plot.title
        drawn = area.find("plot")
        assert drawn is not None
        assert drawn.attrib["mode"] == "TimeSeries"
        assert drawn.attrib["style"] == "Lines"
        # its reader of joint states names series topic/joint/position
        assert [c.attrib["name"] for c in drawn] == [f"{c.topic}/{c.joint}/position" for c in plot.curves]
    assert window.find("currentTabIndex") is not None
