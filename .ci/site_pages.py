"""What the site has beside `docs/`: files of the repository's first level that pages link, the Python API, and pages that may be absent.

A hook of MkDocs: `mkdocs.yml` names it.
"""

from __future__ import annotations

import ast
import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
#: File of the repository, and its page.
OUTSIDE = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "sample_logs/README.md": "samples.md",
}
#: Pages that stand in the section of the navigation where they are.
OPTIONAL = {"python.md": "Reference", "foxglove.md": "How to"}
#: The page of all that `import mfhca` gives, written from the docstrings.
API = "reference/python-api.md"
_LINK = re.compile(r"(?<=\]\()(?!\w+:|#|/)([^)#\s]+)")


def on_config(config: Any) -> Any:
    """Add the pages that are there to the navigation."""
    sections = {title: pages for entry in config.nav if isinstance(entry, dict) for title, pages in entry.items()}
    for page, section in OPTIONAL.items():
        if (ROOT / "docs" / page).is_file():
            sections[section].append(page)
    sections["Reference"].append(API)
    sections["Project"] += [page for name, page in OUTSIDE.items() if (ROOT / name).is_file()]
    return config


def on_files(files: Files, *, config: Any) -> Files:
    """Take in the files outside of `docs/`."""
    for name, page in OUTSIDE.items():
        if (ROOT / name).is_file():
            text = (ROOT / name).read_text(encoding="utf-8")
            files.append(File.generated(config, page, content=_relinked(text, posixpath.dirname(name))))
    files.append(File.generated(config, API, content=api_page()))
    return files


def api_page() -> str:
    """Every name of `mfhca` as mkdocstrings reads it: functions first, then classes with their members, then errors."""
    tree = ast.parse((ROOT / "mfhca" / "__init__.py").read_text(encoding="utf-8"))
    homes = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_HOMES"
    )
    places = [(name, home) for home, names in homes.items() for name in names]
    places.sort(key=lambda place: (place[1] == "replay.errors", not place[0].islower(), place[0]))
    parts = [f"## mfhca.{name}\n\n::: {home}.{name}\n    options: {{heading_level: 3}}\n" for name, home in places]
    return (
        "# Python API\n\nAll that `import mfhca` gives, from its docstrings; [the guide](../python.md) has examples.\n\n"
        + "\n".join(parts)
    )


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Files) -> str:
    """Turn links to files outside of `docs/` into links to their pages."""
    if page.file.generated_by is not None:
        return markdown
    return _relinked(markdown, posixpath.join("docs", posixpath.dirname(page.file.src_uri)), page.file.src_uri)


def _relinked(text: str, folder: str, page: str = "index.md") -> str:
    """Text whose links lead from a page of the site, not from a folder of the repository."""

    def target(match: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join(folder, match[1]))
        path = path.removeprefix("docs/") if path.startswith("docs/") else OUTSIDE.get(path, "")
        return posixpath.relpath(path, posixpath.dirname(page) or ".") if path else match[1]

    return _LINK.sub(target, text)
