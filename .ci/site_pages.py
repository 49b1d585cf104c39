"""What the site has beside `docs/`: the files of the repository's first level that pages link, and pages that may be absent.

A hook of MkDocs: `mkdocs.yml` names it.
"""

from __future__ import annotations

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
_LINK = re.compile(r"(?<=\]\()(?!\w+:|#|/)([^)#\s]+)")


def on_config(config: Any) -> Any:
    """Add the pages that are there to the navigation."""
    sections = {title: pages for entry in config.nav if isinstance(entry, dict) for title, pages in entry.items()}
    for page, section in OPTIONAL.items():
        if (ROOT / "docs" / page).is_file():
            sections[section].append(page)
    sections["Project"] += [page for name, page in OUTSIDE.items() if (ROOT / name).is_file()]
    return config


def on_files(files: Files, *, config: Any) -> Files:
    """Take in the files outside of `docs/`."""
    for name, page in OUTSIDE.items():
        if (ROOT / name).is_file():
            text = (ROOT / name).read_text(encoding="utf-8")
            files.append(File.generated(config, page, content=_relinked(text, posixpath.dirname(name))))
    return files


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
