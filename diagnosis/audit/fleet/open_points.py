"""What a report that names no fault leaves open of which part: what an audit's lists say of a machine that its newest mission does not clear."""

from __future__ import annotations

from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Kind

#: A component and its side.
Part = tuple[str, str]

_CLEAR = 1.25  # times the limit of a check of a few seconds
_NAMED = 2  # components that are named before a reason


def open_points(report: ReportDocument) -> tuple[str, ...]:
    """What deviates although no fault is stated, each with its parts: ``FR speed sensor and drive valve: the speed of FR ...``.

    Parts that were only judged too briefly are not among them, nor what a stated fault leaves open: the lists have both already.
    """
    return tuple(text for _, text in _points(report))


def suspected_parts(report: ReportDocument) -> tuple[tuple[tuple[Part, ...], str], ...]:
    """Those of them in which a value is clearly beyond its limit, each with its parts.

    What a mission did not show is held against no part, nor what was a hair beyond its limit for a few seconds: sound machines do that
    now and then.
    """
    off: list[str] = []
    rest: list[str] = []
    for row in report.get("clearing", ()):
        lasts = row["start_s"] is None
        clear = row["worst"] is not None and row["worst"] >= (1.0 if lasts else _CLEAR) * row["limit"]
        (off if clear else rest).append(row["text"].casefold())

    def deviates(text: str) -> bool:
        said = text.casefold()
        return any(one in said for one in off if one) or not any(one in said for one in rest if one)

    return tuple((parts, text) for parts, text in _points(report) if deviates(text))


def _points(report: ReportDocument) -> list[tuple[tuple[Part, ...], str]]:
    words, axles = words_of(report["machine"]), report["machine"]["axles"]
    out = []
    for point in report["verdict"].get("to_clear", ()):
        if point["fault"] or point["why"] or not point["parts"] or ": judged for " in point["reason"]:
            continue
        parts = tuple((str(p["component"]), str(p["side"])) for p in point["parts"])
        components = {c for c, _ in parts}
        said = point["reason"].rstrip(".")
        if len(components) > _NAMED:
            out.append((parts, said))
            continue
        named = "; ".join(
            words.listed(kind, own)
            for kind in Kind
            if (own := [(c, side) for c, side in parts if (c in axles) is (kind is Kind.STEER)])
        )
        out.append((parts, f"{named}: {said[:1].lower()}{said[1:]}"))
    return out
