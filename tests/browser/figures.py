"""What a figure of a page shows once it has been drawn."""

from __future__ import annotations

from typing import Any

import pytest

_RANGE = "figure => document.getElementById(figure).layout.xaxis.range.map(Number)"
_SHOWN = f"""([figure, expected, within]) => {{
  const range = ({_RANGE})(figure);
  return range.every((v, i) => Math.abs(v - expected[i]) < within);
}}"""


def shows_time(page: Any, figure: str, expected: list[float], within: float = 1e-6) -> None:
    """Waits until a figure's axis shows a range of time [s], each end within `within`: views in between may be drawn first."""
    try:
        page.wait_for_function(_SHOWN, arg=[figure, expected, within], timeout=10_000)
    except Exception as slow:
        pytest.fail(f"{figure} shows {page.evaluate(_RANGE, figure)}, expected {expected}: {slow}")
