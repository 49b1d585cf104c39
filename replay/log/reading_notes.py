"""What goes with a log while it is read: notes of harmless facts and of what was lost, and the store of its columns."""

from __future__ import annotations

from dataclasses import dataclass, field

from replay.arrays.column_store import ColumnStore
from replay.border import shortened


@dataclass
class Report:
    """Notes and damage gathered while reading, repeated sentences once; and where long columns stand."""

    notes: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    store: ColumnStore = field(default_factory=ColumnStore)

    def note(self, text: str) -> None:
        """Add a harmless fact."""
        text = shortened(text)
        if text not in self.notes:
            self.notes.append(text)

    def lost(self, text: str) -> None:
        """Add a loss."""
        text = shortened(text)
        if text not in self.damage:
            self.damage.append(text)
