"""How commands look in help, and the options that each of them has."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cli.terminal.console import Terminal

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Errors only.", show_default=False)]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="More detail; tracebacks of internal errors.", show_default=False)
]


def terminal_of(context: typer.Context, *, quiet: bool = False, verbose: bool = False) -> Terminal:
    """Terminal of this run, with what the options add."""
    root = context.find_root()
    if not isinstance(root.obj, Terminal):
        root.obj = Terminal()
    root.obj.quiet |= quiet
    root.obj.verbose |= verbose
    return root.obj


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command -q and -v of its own, and the run's `Terminal` as its first argument.

    Parameters
    ----------
    function : callable
        ``function(terminal, …)``; the other parameters are annotated for typer.
    """

    def run(**values: Any) -> None:
        terminal = terminal_of(values.pop("context"), quiet=values.pop("quiet"), verbose=values.pop("verbose"))
        terminal.json = bool(values.get("json", False))
        function(terminal, **values)

    plain = inspect.Parameter.KEYWORD_ONLY
    own = [p.replace(kind=plain) for p in list(inspect.signature(function, eval_str=True).parameters.values())[1:]]
    added = [inspect.Parameter("context", plain, annotation=typer.Context)]
    added += [
        inspect.Parameter(name, plain, default=False, annotation=kind)
        for name, kind in (("quiet", Quiet), ("verbose", Verbose))
    ]
    run.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in (*own, *added)}
    run.__name__, run.__doc__ = function.__name__, function.__doc__
    return run


class App(TyperGroup):
    """A group whose help lists commands by topic."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the commands under the names of their panels."""
        panels: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            shown: Any = self.get_command(ctx, name)
            panel = getattr(shown, "rich_help_panel", None)
            title = panel if isinstance(panel, str) else "Commands"
            panels.setdefault(title, []).append((name, shown.get_short_help_str(100)))
        for title, rows in panels.items():
            with formatter.section(title):
                formatter.write_dl(rows)
