"""Files that a page gives."""

from __future__ import annotations

from typing import Any


def saved(page: Any, button: Any) -> Any:
    """The download of a button, pressed by key: no plot that is still being drawn moves it away from under a pointer."""
    with page.expect_download() as download:
        button.press("Enter")
    return download.value
