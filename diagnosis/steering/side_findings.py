"""What was found on one side of a steering axle, and what of it is left unexplained."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from diagnosis.results.assessment import Finding

Span = tuple[int, int]


class SideFindings(NamedTuple):
    """What was found on one side of an axle.

    Attributes
    ----------
    findings : tuple[Finding, ...]
        Faults, their ends at samples.
    unexplained : tuple[tuple[int, int], ...]
        Blocks in a faulty row of which no fault may be stated.
    refuted : tuple[tuple[int, int], ...]
        Blocks in a faulty row that a measurement of the same quantity refutes.
    """

    findings: tuple[Finding, ...]
    unexplained: tuple[Span, ...]
    refuted: tuple[Span, ...] = ()

    def left_open(self, some: Collection[Finding], length: int) -> SideFindings:
        """The same without some of its findings, whose blocks of `length` samples are left unexplained."""
        if not some:
            return self
        return self._replace(
            findings=tuple(f for f in self.findings if f not in some),
            unexplained=(*self.unexplained, *(span_of(f, length) for f in some)),
        )


def span_of(finding: Finding, length: int) -> Span:
    """Blocks of `length` samples that a finding touches: the first, and the one behind the last."""
    return finding.start // length, -(-finding.stop // length)
