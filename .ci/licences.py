"""Write `docs/licences.md`: the licence of every locked dependency, as its own metadata states it.

`python .ci/licences.py` in an environment made from `requirements-dev.lock`, after `.ci/lock`.
"""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_PIN = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)(?:\s*;\s*([^\\]+))?", re.MULTILINE)


def pins(lock: str) -> dict[str, str]:
    """Names of a lock file, and on which platforms each is needed (empty: on all)."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    return {name.lower(): (marker or "").strip() for name, _, marker in _PIN.findall(text)}


def licence_of(name: str) -> str:
    """What a distribution states: its SPDX expression, else its classifiers, else its licence field.

    Raises
    ------
    PackageNotFoundError
        Where it is not installed here.
    """
    metadata = distribution(name).metadata
    if metadata["License-Expression"]:
        return str(metadata["License-Expression"])
    classified = [c.split(" :: ")[-1] for c in metadata.get_all("Classifier", []) if c.startswith("License :: ")]
    named = [text for text in classified if text != "OSI Approved"]
    if named:
        return ", ".join(dict.fromkeys(named))
    first = (metadata["License"] or "").strip().partition("\n")[0].strip()
    return first or "not stated"


def _rows(names: dict[str, str]) -> str:
    """Table of distributions."""
    text = "| package | licence |\n|---|---|\n"
    for name, marker in sorted(names.items()):
        try:
            text += f"| {name} | {licence_of(name)} |\n"
        except PackageNotFoundError:
            shown = marker.replace("|", "\\|") or "not installed where this page was written"
            text += f"| {name} | only where `{shown}` |\n"
    return text


def page() -> str:
    """The whole page."""
    needed, all_of_them = pins("requirements.lock"), pins("requirements-dev.lock")
    text = "# Licences\n\n"
    text += "mfhca-replay is under the Apache License 2.0 and holds no code of others. What it needs is installed from a package index; "
    text += "the tables state the licences as each package's metadata does. Versions stand in the lock files.\n\n"
    text += f"## To use it\n\n{_rows(needed)}\n"
    rest = {name: marker for name, marker in all_of_them.items() if name not in needed}
    text += f"## To work on it\n\nTests, checks, documentation and the optional extras.\n\n{_rows(rest)}"
    return text + "\n<!-- written by .ci/licences.py -->\n"


if __name__ == "__main__":
    (ROOT / "docs" / "licences.md").write_text(page(), encoding="utf-8")
