"""The verdict of a mission as plain values, and the exit code that it makes."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.report.confidence import headline
from diagnosis.report.tables import merged_caveats
from diagnosis.results.document import PAPER_DEFAULTS, ReportDocument
from diagnosis.results.vocabulary import Severity
from diagnosis.results.vocabulary import Verdict as Status
from replay.errors import ConfigError

NEVER = "never"
_FAULTS, _NOT_JUDGED = 1, 3


@dataclass(frozen=True)
class Verdict:
    """Whether the machine may go out, and why not.

    Attributes
    ----------
    status : str
        ``ready``, ``watch``, ``stop`` or ``not_assessed``.
    cleared : bool
        Whether every wheel part was judged long enough, the log is whole, and nothing stops the machine.
    label : str
        The status in words: ``Stop and repair``.
    answer : str
        Whether it may go out: ``must not go out before repair``; empty where the label says it.
    title, text : str
        The finding in a line, and in a sentence or two.
    not_cleared : str
        Why the machine is not cleared; empty where it is, or where faults say it.
    assumed : tuple[str, ...]
        Numbers of the paper's machine that stand in for this one's.
    scope, caveats, actions : tuple[str, ...]
        Why not the whole mission was judged; limits of the verdict; what to do, the most urgent first.
    """

    status: str
    cleared: bool
    label: str
    answer: str
    title: str
    text: str
    not_cleared: str
    assumed: tuple[str, ...]
    scope: tuple[str, ...]
    caveats: tuple[str, ...]
    actions: tuple[str, ...]

    @classmethod
    def of(cls, report: ReportDocument) -> Verdict:
        """The verdict of a report."""
        row = report["verdict"]
        label, answer = headline(report)
        return cls(
            str(row["status"]),
            row["cleared"],
            label,
            answer,
            row["title"],
            row["text"],
            row["not_cleared"],
            tuple(report["machine"]["assumed"]),
            tuple(row["scope"]),
            tuple(merged_caveats(row["caveats"])),
            tuple(action["text"] for action in row["actions"]),
        )

    @property
    def headline(self) -> str:
        """The label, and whether the machine may go out: ``Stop and repair – must not go out before repair``."""
        return f"{self.label} – {self.answer}" if self.answer else self.label

    @property
    def why(self) -> str:
        """Why the verdict is as it is, in a sentence or two; empty where the label says all."""
        said = {self.label.casefold(), self.answer.casefold()}
        words = dict.fromkeys(w for w in (self.text or self.title, self.not_cleared) if w and w.casefold() not in said)
        return " ".join(words)

    def __str__(self) -> str:
        return f"{self.headline}. {self.why}" if self.why else self.headline


def exit_code(report: ReportDocument, fail_on: str = "low") -> int:
    """Exit code of `mfhca diagnose`: 1 where a fault is at least as severe as asked, else 3 where nothing could be judged.

    Parameters
    ----------
    report : ReportDocument
        The document.
    fail_on : str
        Lowest severity that counts: ``info``, ``low``, ``medium``, ``high``, or ``never``: always 0.

    Raises
    ------
    ConfigError
        Where that is none of them.
    """
    check_fail_on(fail_on)
    if fail_on == NEVER:
        return 0
    least = Severity(fail_on).rank
    if any(Severity(interval["severity"]).rank >= least for interval in report["intervals"]):
        return _FAULTS
    return _NOT_JUDGED if report["verdict"]["status"] == Status.NOT_ASSESSED else 0


def check_fail_on(fail_on: str) -> None:
    """Raise a `ConfigError` where that is no severity, nor ``never``."""
    if fail_on not in (*Severity, NEVER):
        raise ConfigError(f"--fail-on {fail_on}: is not known; expected one of {', '.join((*Severity, NEVER))}")


def assumed_words(report: ReportDocument) -> str:
    """What stands in for numbers that no machine file gave, in a sentence; empty where nothing does."""
    machine = report["machine"]
    if not machine["assumed"]:
        return ""
    given = machine["source"] != PAPER_DEFAULTS
    what = f"{machine['source']} leaves out some numbers" if given else "No machine file was given"
    return f"{what}: the paper's Haulotte 16RTJ PRO stands in."
