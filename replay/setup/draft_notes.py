"""What a draft of a machine has found, and what it must ask."""

from __future__ import annotations

from dataclasses import dataclass, field

from replay.machine.config import Machine
from replay.machine.questions import QUESTION
from replay.signals.signal import Signals


@dataclass
class Draft:
    """A machine as far as a log shows it.

    Attributes
    ----------
    machine : Machine
        The machine, with every signal that was found.
    found : list[str]
        Where its structure and lengths come from, and which wheels count backwards: one sentence each.
    questions : list[str]
        What the log does not tell and a person must check or fill in: one sentence each.
    signals : Signals
        As the machine finds them in the log.
    notes : dict[str, list[str]]
        Comments by section of the machine file.
    unpowered : tuple[str, ...]
        Wheels that may have no drive.
    idle : tuple[str, ...]
        Files of which no channel is used.
    """

    machine: Machine
    found: list[str] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)
    signals: Signals = field(default_factory=lambda: Signals({}, {}))
    notes: dict[str, list[str]] = field(default_factory=dict)
    unpowered: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()

    def say(self, section: str, text: str) -> None:
        """Add a sentence, also as a comment of a section."""
        self.found.append(text)
        self.notes.setdefault(section, []).append(text)

    def ask(self, section: str, text: str) -> None:
        """Add a question, also as a comment of a section."""
        self.questions.append(text)
        self.notes.setdefault(section, []).append(f"{QUESTION}{text}")
