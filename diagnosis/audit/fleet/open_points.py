"""What a report that names no fault leaves open of which part: what an audit's lists say of a machine that its newest mission does not clear."""

from __future__ import annotations

from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Kind

_NAMED = 2  # components that are named before a reason


def open_points(report: ReportDocument) -> tuple[str, ...]:
    """What deviates although no fault is stated, each with its parts: ``FR speed sensor and drive valve: the speed of FR ...``.

    Parts that were only judged too briefly are not among them, nor what a stated fault leaves open: the lists have both already.
    """
    words, axles = words_of(report["machine"]), report["machine"]["axles"]
    out = []
    for point in report["verdict"].get("to_clear", ()):
        if point["fault"] or point["why"] or not point["parts"] or ": judged for " in point["reason"]:
            continue
        parts = [(p["component"], p["side"]) for p in point["parts"]]
        components = {c for c, _ in parts}
        said = point["reason"].rstrip(".")
        if len(components) > _NAMED:
            out.append(said)
            continue
        named = "; ".join(
            words.listed(kind, own)
            for kind in Kind
            if (own := [(c, side) for c, side in parts if (c in axles) is (kind is Kind.STEER)])
        )
        out.append(f"{named}: {said[:1].lower()}{said[1:]}")
    return tuple(out)
