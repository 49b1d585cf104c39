"""What all pages share: package data, policy, style, head, and the environment of their templates."""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import jinja2
from jinja2.bccache import Bucket
from markupsafe import Markup

from diagnosis.pages.mode_style import mode_style

#: Blocks of variables of the dark theme in `shared_style`.
DARK = re.compile(r"\[data-theme=dark\] \{([^}]*)\}")
_UNIT = re.compile(r"(?<=\d) (?=(?:%|°|m/s|rad/s|rad|[km]?m|[mk]?Hz|ms|min|[shd]|MB)(?!\w))")
#: Style, scripts and templates that several pages share.
SHARED = Path(__file__).parent
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


@lru_cache
def asset(path: Path) -> str:
    """Text of a style or script of this package."""
    return path.read_text("utf-8")


@lru_cache
def shared_style() -> str:
    """Style of all pages: the rules of every fault mode, and ``style.css``, which may override them."""
    return mode_style() + asset(SHARED / "style.css")


@lru_cache
def plain_style(own: Path) -> Markup:
    """Style of a page without scripts: the shared one, dark by the system's choice alone, and the page's own."""
    dark = DARK.sub(r"@media (prefers-color-scheme: dark) { :root {\1} }", shared_style())
    return Markup(dark + asset(own))


def environment(folder: Path) -> jinja2.Environment:
    """Templates of a folder and the shared ones: everything is escaped, and a name that is missing is an error."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader([folder, SHARED]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=unbroken,
        trim_blocks=True,
        lstrip_blocks=True,
        bytecode_cache=_compiled_before(),
    )


def unbroken(value: object) -> object:
    """A text whose numbers stay on the line of their unit; what is markup already, or no text, as it is."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return _UNIT.sub("\u00a0", value)
    return value


class _Kept(jinja2.FileSystemBytecodeCache):
    """Compiled templates in a folder; one that cannot be written is compiled again next time."""

    def dump_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):
            super().dump_bytecode(bucket)


def _compiled_before() -> jinja2.BytecodeCache | None:
    """Compiled templates of all pages beside the compiled modules, where those may be written."""
    folder = Path(__file__).parent / "__pycache__"
    if sys.dont_write_bytecode or not (folder.is_dir() and os.access(folder, os.W_OK)):
        return None
    return _Kept(str(folder), "template-%s.pyc")
