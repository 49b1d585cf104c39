"""What the fuzzer passes around: samples, damaged cases, readings and findings."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


class Finding(Exception):
    """Something that must not happen.

    Parameters
    ----------
    kind : str
        ``foreign`` (an error that is not the project's), ``silent`` (short or wrong without a word although a checksum or
        a count tells it), ``memory``, ``hang``, ``crash`` or ``shape``.
    text : str
        What happened.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(f"{kind}: {text}")
        self.kind, self.text = kind, text


@dataclass(frozen=True)
class Sample:
    """A sound input.

    Attributes
    ----------
    name : str
        Of the sample, unique within its format.
    files : Mapping[str, bytes]
        Content by path within the input's folder.
    log : str
        The path that is opened.
    target : str
        The path that is damaged.
    facts : Mapping[str, Any]
        What the format's module knows of it; ``said`` is what is said of it when it is read, ``sound`` the outcome.
    """

    name: str
    files: Mapping[str, bytes]
    log: str
    target: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def raw(self) -> bytes:
        """Content of the file that is damaged."""
        return self.files[self.target]


@dataclass(frozen=True)
class Case:
    """A damaged input.

    Attributes
    ----------
    content : bytes
        Of the sample's target.
    what : str
        What was done to it.
    facts : Mapping[str, Any]
        What the format's module is to know when it judges.
    """

    content: bytes
    what: str
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reading:
    """What reading an input ended in.

    Attributes
    ----------
    outcome : str
        ``whole``, ``degraded`` or ``refused``.
    content : Any
        What came out; None where it was refused.
    said : tuple[str, ...]
        What was said of it, but for what is said of the sound sample too.
    """

    outcome: str
    content: Any = None
    said: tuple[str, ...] = ()


class Target(Protocol):
    """A format: its sound inputs, its damages, and what reading must hold to."""

    name: str

    def corpus(self, folder: Path) -> list[Sample]:
        """Make the samples, always the same; `folder` is empty and may be used."""

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Damage a sample."""

    def read(self, path: Path, source: random.Random) -> Reading:
        """Read an input as users do; raises a `Finding`, or anything else, which is one too."""

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Compare what came out with what is known and with what other libraries read; raises a `Finding`."""
