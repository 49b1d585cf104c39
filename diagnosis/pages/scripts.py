"""Scripts of pages that work offline: the installed plotly.js, packed, and a policy that admits exactly the page's own scripts."""

from __future__ import annotations

import base64
import hashlib
import re
import zlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from diagnosis.pages.plotly_scatter import scatter_alone
from replay.errors import ConfigError


@lru_cache
def packed_plotly(path: Path | None = None) -> tuple[str, str, str]:
    """Source of plotly.js as pages embed it, the same deflated in base64, and its version.

    Parameters
    ----------
    path : Path or None
        Bundle to take, as it is, instead of the installed package's, of which pages need the core alone.

    Raises
    ------
    ConfigError
        Where it cannot be read.
    """
    if path is None:
        from plotly.offline import get_plotlyjs

        source = scatter_alone(str(get_plotlyjs()))
    else:
        try:
            source = path.read_text("utf-8-sig")
        except (OSError, UnicodeDecodeError) as e:
            raise ConfigError(f"--plotlyjs {path}: cannot be read ({e}); expected a plotly.js bundle") from e
    found = re.search(r"plotly\.js(?: \([\w-]+ - minified\))? v([\d.]+)", source[:2000])
    return source, packed(source.encode()), found[1] if found else "unknown"


def packed(text: bytes) -> str:
    """Deflated, in base64, for a script element that holds data."""
    return base64.b64encode(zlib.compress(text, 9)).decode("ascii")


def script_policy(scripts: Sequence[str]) -> str:
    """Content security policy that admits these scripts and nothing else."""
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
