"""What the pages without scripts share: policy, style, head, and the environment of their templates."""

from __future__ import annotations

import os
import re
import sys
from functools import lru_cache
from pathlib import Path

import jinja2
from markupsafe import Markup

_HERE = Path(__file__).parent
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


@lru_cache
def plain_style(name: str) -> Markup:
    """Style of the mission report, dark by the system's choice alone, and what is special to one page."""
    shared = (_HERE / "report.css").read_text("utf-8")
    dark = re.sub(r"\[data-theme=dark\] \{([^}]*)\}", r"@media (prefers-color-scheme: dark) { :root {\1} }", shared)
    return Markup(dark + (_HERE / name).read_text("utf-8"))


def environment() -> jinja2.Environment:
    """Templates of this package: everything is escaped, and a name that is missing is an error."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        bytecode_cache=_compiled_before(),
    )


def _compiled_before() -> jinja2.BytecodeCache | None:
    """Compiled templates beside the compiled modules, where those may be written."""
    folder = _HERE / "__pycache__"
    if sys.dont_write_bytecode or not (folder.is_dir() and os.access(folder, os.W_OK)):
        return None
    return jinja2.FileSystemBytecodeCache(str(folder), "template-%s.pyc")
