"""Numbers that documents hold, with the range that they can have."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

#: A probability, but for rounding.
Probability = Annotated[float, Meta(ge=-1e-6, le=1.0 + 1e-6)]
#: A time or a length of time that a recording can have [s].
Seconds = Annotated[float, Meta(ge=-1e9, le=1e9)]
