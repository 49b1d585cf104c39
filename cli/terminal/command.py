"""What all commands share: how groups look in help, the terminal of a run, and -q and -v."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from cli.terminal.console import Terminal

USAGE = 2


def terminal_of(context: typer.Context, *, json: bool = False) -> Terminal:
    """Terminal of this run.

    Parameters
    ----------
    context : typer.Context
        Of a command, or of the group above it.
    json : bool
        Whether the command writes one JSON document to stdout.
    """
    root = context.find_root()
    if not isinstance(root.obj, Terminal):
        root.obj = Terminal()
    root.obj.json |= json
    return root.obj


def _be_quiet(context: typer.Context, asked: bool) -> bool:
    terminal_of(context).quiet |= asked
    return asked


def _be_verbose(context: typer.Context, asked: bool) -> bool:
    terminal_of(context).verbose |= asked
    return asked


#: Each command and the program have these two; their values go to the terminal, before the command runs.
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Errors only.", show_default=False, callback=_be_quiet)]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose",
        "-v",
        help="More detail; tracebacks of internal errors.",
        show_default=False,
        callback=_be_verbose,
    ),
]


class Command(TyperCommand):
    """A command whose usage line leaves out hidden arguments: those that are only there to be refused with reasons."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Words of the usage line."""
        hidden = {
            piece for p in self.get_params(ctx) if getattr(p, "hidden", False) for piece in p.get_usage_pieces(ctx)
        }
        return [piece for piece in super().collect_usage_pieces(ctx) if piece not in hidden]


class App(TyperGroup):
    """A group whose help lists commands by topic, and is shown where no command is given."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the words of the command line.

        Raises
        ------
        typer.Exit
            Where there are none: with the code of a usage error, behind the help.
        """
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help(), err=True)
            raise typer.Exit(USAGE)
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Command that the first words name: one of two words goes before that of its first word."""
        two = " ".join(args[:2])
        if len(args) > 1 and two in self.commands:
            return two, self.commands[two], args[2:]
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the commands under the names of their panels."""
        panels: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            shown: Any = self.get_command(ctx, name)
            panel = getattr(shown, "rich_help_panel", None)
            title = panel if isinstance(panel, str) else "Commands"
            panels.setdefault(title, []).append((name, shown.get_short_help_str(200)))
        for title, rows in panels.items():
            with formatter.section(title):
                formatter.write_dl(rows)
