"""Signs and styles of modes, severities and verdicts on the terminal; their words come from the diagnosis."""

from __future__ import annotations

from rich.text import Text

from cli.tables.layout import text
from diagnosis.results.fault_rows import LOOKS
from diagnosis.results.vocabulary import Severity, Verdict

_NO_SIGN = "·"
SEVERITY_STYLES = {Severity.HIGH: "bold red", Severity.MEDIUM: "#d99a00", Severity.LOW: "", Severity.INFO: "dim"}
_TITLES = {
    Verdict.READY: "bold white on #1d7a63",
    Verdict.WATCH: "bold black on #f2b11b",
    Verdict.STOP: "bold white on #b63a00",
    Verdict.NOT_ASSESSED: "bold reverse",
}


def mode_text(mode: str, words: str) -> Text:
    """A mode or state behind its sign, in its colour; what has none is plain, behind a point."""
    look = LOOKS.get(mode)
    sign, style = (look.sign, look.terminal) if look is not None else ("", "")
    return text(f"{sign or _NO_SIGN} {words}", style)


def severity_text(severity: Severity, words: object | None = None) -> Text:
    """A severity, or what has it, in its style."""
    return text(severity if words is None else words, SEVERITY_STYLES[severity])


def verdict_style(verdict: Verdict) -> str:
    """Style of a verdict within a line or table."""
    return LOOKS[verdict.symbol].terminal


def verdict_title(verdict: Verdict, words: str) -> Text:
    """A verdict on its own background, for the first line."""
    return Text(f" {words.upper()} ", style=_TITLES[verdict])
