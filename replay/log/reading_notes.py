"""What was found while a log was read: harmless facts, and what was damaged or lost."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Report:
    """Notes and damage gathered while reading; repeated sentences are kept once."""

    notes: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a harmless fact."""
        if text not in self.notes:
            self.notes.append(text)

    def lost(self, text: str) -> None:
        """Add a loss."""
        if text not in self.damage:
            self.damage.append(text)
