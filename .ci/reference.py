"""Write the pages of `docs/reference/` that are made from the program: commands, report.json, machine file.

`python .ci/reference.py` after a change of commands, documents or the machine file; a test says when it is due.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from cli.main import app  # noqa: E402 - from this repository
from diagnosis.documents import schema_of  # noqa: E402

_MADE = "\n<!-- written by .ci/reference.py -->\n"
_GENERAL = {"quiet", "verbose"}


def _cell(text: str) -> str:
    """Text in a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


# --- commands ---------------------------------------------------------------------------------------------------------


def _leaves(group: Any, context: Any) -> Iterator[tuple[str, Any, Any]]:
    """Name, command and context of each command, those of groups too."""
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = type(context)(command, info_name=name, parent=context)
        if hasattr(command, "list_commands"):
            yield from _leaves(command, inner)
        else:
            yield inner.command_path, command, inner


def commands_page() -> str:
    """Page of every command with its arguments, options and examples."""
    group: Any = typer.main.get_command(app)
    root = typer.Context(group, info_name="mfhca")
    text = "# Commands\n\n"
    text += "Every command also takes `-q` (errors only), `-v` (more detail) and `-h` (help). "
    text += "Their codes: [exit codes](exit-codes.md).\n"
    for path, command, context in _leaves(group, root):
        text += f"\n## {path}\n\n{_cell(command.help or '')}\n\n"
        usage = " ".join(command.collect_usage_pieces(context))
        text += f"```text\n{path} {usage}\n```\n\n| | |\n|---|---|\n"
        for parameter in command.params:
            record = parameter.get_help_record(context)
            if record is not None and parameter.name not in _GENERAL:
                text += f"| `{_cell(record[0]).replace('&lt;', '<')}` | {_cell(record[1])} |\n"
        if command.epilog:
            text += f"\n```text\n{command.epilog.replace(chr(8), '').strip()}\n```\n"
    return text + _MADE


# --- report.json ------------------------------------------------------------------------------------------------------


def _type(schema: dict[str, Any]) -> str:
    """JSON type of a value in words, with links to the types of this page."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(_type(one) for one in schema["anyOf"])
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    kind = schema.get("type", "any")
    if kind == "array":
        return f"list of {_type(schema['items'])}" if schema.get("items") else "list"
    if kind == "object" and schema.get("additionalProperties"):
        return f"map of {_type(schema['additionalProperties'])}"
    return str(kind)


def report_page() -> str:
    """Page of the types of report.json."""
    schema = schema_of("report")
    text = "# report.json\n\n"
    text += f"Schema `{schema['title'].rpartition(' ')[2]}`, as JSON Schema by `mfhca schema report`. "
    text += (
        "Times are seconds from the mission's start unless a name ends in `_ns`; SI units; what is not known is null. "
    )
    text += "Later versions may add keys and rename none; a key in *italics* may be absent.\n\n"
    text += "The other documents have schemas alike: `mfhca schema comparison`, `scores`, `counterfactual`, `fleet`.\n"
    for name, row in schema["$defs"].items():
        text += f"\n## {name}\n\n{_prose(row.get('description', ''))}\n"
        if "enum" in row:
            text += "\n" + ", ".join(f"`{value}`" for value in row["enum"]) + "\n"
        if "properties" in row:
            text += "\n| key | value |\n|---|---|\n"
            for key, value in row["properties"].items():
                shown = f"`{key}`" if key in row.get("required", ()) else f"*`{key}`*"
                text += f"| {shown} | {_type(value)} |\n"
    return text + _MADE


def _prose(docstring: str) -> str:
    """A docstring as Markdown: paragraphs, code marked with one backtick."""
    paragraphs = [" ".join(part.split()) for part in docstring.replace("``", "`").split("\n\n")]
    return "\n\n".join(paragraphs)


# --- machine file -----------------------------------------------------------------------------------------------------


def machine_page() -> str:
    """Page of every key of the machine file: the starter file, section by section."""
    starter = (ROOT / "cli" / "commands" / "starter.toml").read_text(encoding="utf-8")
    _, *sections = re.split(r"^(?=\[)", starter, flags=re.MULTILINE)
    text = "# Machine file\n\n"
    text += "TOML; every key may be left out. A line that is commented out shows the default, for which the paper's machine, "
    text += "the Haulotte 16RTJ PRO, stands in. `mfhca config init` prints this starter; "
    text += "[machine files by example](../how-to/machine-file.md) has whole ones.\n"
    for section in sections:
        name = section[1 : section.index("]")]
        text += f"\n## {name}\n\n```toml\n{section.strip()}\n```\n"
    return text + _MADE


#: Page, and what writes it.
PAGES = {"commands.md": commands_page, "report-json.md": report_page, "machine-file.md": machine_page}

if __name__ == "__main__":
    for page, written in PAGES.items():
        (ROOT / "docs" / "reference" / page).write_text(written(), encoding="utf-8")
