"""Bundles of plotly.js cut down to what pages draw."""

from __future__ import annotations

from plotly.offline import get_plotlyjs

from diagnosis.pages.plotly_scatter import scatter_alone
from diagnosis.pages.scripts import packed_plotly

HEAD = "/**\n* plotly.js v1.2.3\n*/\nvar a=W((q,b)=>{b.exports=1});"
CORE = 'var core=W((x,y)=>{"use strict";y.exports=a()});'
KINDS = "var bar=W((p,q)=>{q.exports={a:{}}});var pie$=W((r,s)=>{s.exports=2});"
INDEX = "var all=W((n,o)=>{var m=core();m.register([bar(),pie$()]);o.exports=m});return all();"
FOOT = "\n/*! licences */"


def test_modules_behind_the_core_are_left_out() -> None:
    assert scatter_alone(HEAD + CORE + KINDS + INDEX + FOOT) == (
        HEAD + CORE + "var all=W((n,o)=>{var m=core();m.register([]);o.exports=m});return all();" + FOOT
    )


def test_a_bundle_built_another_way_stays_whole() -> None:
    for text in ("window.Plotly = {};", HEAD + KINDS + INDEX, HEAD + CORE + KINDS):
        assert scatter_alone(text) == text


def test_the_installed_bundle_shrinks_and_keeps_its_licences() -> None:
    source, packed, version = packed_plotly()
    whole = str(get_plotlyjs())
    assert len(source) < 0.3 * len(whole)
    assert len(packed) < 600_000
    assert f"plotly.js v{version}" in whole
    assert whole[:200] == source[:200]
    tail = whole[whole.index("/*!", len(whole) - 10_000) :]
    assert source.endswith(tail)
