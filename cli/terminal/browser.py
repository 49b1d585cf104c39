"""Showing a page in the user's browser; where that cannot be done, saying where the page is."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from cli.terminal.console import Terminal


def show_page(terminal: Terminal, page: Path) -> None:
    """Open a page in the default browser; never an error, because the page stands either way."""
    import webbrowser

    reason = "there is no display"
    if _has_display():
        reason = "no browser could be started"
        try:
            if webbrowser.open(page.resolve().as_uri()):
                return
        except (webbrowser.Error, OSError) as error:
            reason = f"the browser could not be started ({error})"
    terminal.note(f"{reason}; open {page.resolve()} yourself")


def _has_display() -> bool:
    """Whether a window can appear: a browser of the terminal would take it over."""
    if sys.platform in ("win32", "darwin"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
