"""plotly.js with lines over axes alone: the other kinds of plots, three quarters of the bundle, are left out of a page."""

from __future__ import annotations

import re

# The last module of a bundle asks for the core, which knows scatter, and registers all other kinds of traces with it.
_INDEX = re.compile(
    r"var (?P<index>[\w$]+)=(?P<module>[\w$]+)\(\([\w$]+,(?P<out>[\w$]+)\)=>\{var (?P<own>[\w$]+)=(?P<core>[\w$]+)\(\);"
    r"(?P=own)\.register\((?P<kinds>\[[\w$(),]*\])\);(?P=out)\.exports=(?P=own)\}\);return (?P=index)\(\);"
)


def scatter_alone(source: str) -> str:
    """Bundle of plotly.js without the modules behind its core but for the index; unchanged where it is built another way.

    A bundler writes modules after those that they need. So nothing up to the core needs what stands between it and
    the index.

    Parameters
    ----------
    source : str
        Minified bundle; licences in its comments stay.
    """
    index = _INDEX.search(source)
    if index is None:
        return source
    core = rf"var {re.escape(index['core'])}={re.escape(index['module'])}\(\([\w$]+,([\w$]+)\)=>\{{[^{{}}]*\}}\);"
    found = re.search(core, source[: index.start()])
    if found is None:
        return source
    first, last = index.span("kinds")
    return source[: found.end()] + source[index.start() : first] + "[]" + source[last:]
