"""How sure the tool is, in a plain phrase: probability, how it was decided, and how much of the driving was judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.comparison.coverage import SideCoverage, sides_of
from diagnosis.pages.labels import VERDICTS, state_label
from diagnosis.results.earlier import completed

_WORDS = ((0.99, "Practically certain"), (0.9, "Very likely"), (0.7, "Likely"))
_OPEN, _TIE = 0.9, 1e-3
_ANSWERS = {"stop": "must not go out as it is", "ready": "", "not_assessed": "whether it may go out is not known"}
_HOW = {
    ("wheel", "sensor", "direct"): "measured against a second speed sensor",
    ("wheel", "actuator", "direct"): "measured against the valve's position",
    ("steer", "sensor", "direct"): "measured against a second angle sensor",
    ("steer", "actuator", "direct"): "measured against the valve's position",
    ("wheel", "model"): "by the wheel model, without a second measurement",
    ("steer", "model"): "by the steering model, without a second measurement",
    "drive": "by the drive's own effort, without a second measurement",
    "signal": "from the channel alone",
    "tracking": "because the command is not followed; sensor and drive cannot be told apart",
}
_TIERS = {
    "direct": "second measurements",
    "model": "a model of the wheels",
    "drive": "a model of the drive",
    "signal": "single channels",
    "tracking": "how the command is followed",
}


def percent(p: float) -> str:
    """Probability or share as a percentage that never claims certainty it does not have."""
    return "over 99.9 %" if p > 0.999 else f"{100 * p:.1f} %" if p > 0.9 else f"{100 * p:.0f} %"


def sure_of(fault: Mapping[str, Any], report: Mapping[str, Any]) -> str:
    """How sure the tool is of one fault.

    Parameters
    ----------
    fault : Mapping[str, Any]
        One of the report's intervals.
    report : Mapping[str, Any]
        The parsed ``report.json``.
    """
    p, tier = fault.get("probability"), fault.get("tier") or ""
    faulty = 1.0 - sum(h["p"] for h in fault.get("hypotheses") or () if h["mode"] == "healthy")
    words = []
    if p is not None and (p >= _OPEN or faulty <= p + 0.05 or not fault.get("hypotheses")):
        words.append(f"{_likely(p)} ({percent(p)})")
    elif p is not None:
        first = max(h["p"] for h in fault["hypotheses"] if h["mode"] != "healthy") <= p + _TIE
        row = f"{'most likely' if first else 'perhaps'} {state_label(fault['mode'], fault['side']).lower()}"
        words.append(f"{_likely(faulty)} faulty ({percent(faulty)}), {row} ({percent(p)})")
    how = _HOW.get((fault["kind"], fault["side"], tier)) or _HOW.get((fault["kind"], tier)) or _HOW.get(tier, "")
    words += [how] if how else []
    wanted = ("sensor", "actuator") if fault["side"] == "sensor_or_actuator" else (fault["side"],)
    shares = [
        float(row["decided_driving_s"]) / row["driving_s"]
        for row in report.get("coverage") or ()
        if row["component"] == fault["component"] and row["side"] in wanted and row.get("driving_s")
    ]
    if shares:
        words.append(f"{_share(min(shares))} of its driving was judged")
    return ", ".join(words)


def _likely(p: float) -> str:
    return next((words for least, words in _WORDS if p >= least), "Possible" if p < 0.5 else "Probable")


def judged(report: Mapping[str, Any]) -> str:
    """How many parts were judged as far as a verdict of *ready* takes; empty where nothing says so."""
    sides = known_sides(report)
    done = sum(s.assessed for s in sides.values())
    return f"{done} of {len(sides)} parts" if sides else ""


def sure_of_verdict(report: Mapping[str, Any]) -> str:
    """How sure the tool is of a verdict without faults: how much was judged, and by what."""
    sides = known_sides(report)
    axles = (report.get("machine") or {}).get("axles") or ()
    wheels = [s for (c, _), s in sides.items() if c not in axles]
    if not wheels:
        return ""
    done = [s for s in wheels if s.assessed]
    tiers = list(dict.fromkeys(_TIERS[s.tier] for s in wheels if s.tier in _TIERS))
    how = f", by {' and '.join(tiers)}" if tiers else ""
    if len(done) < len(wheels):
        return f"{len(done)} of {len(wheels)} wheel parts were judged long enough{how}."
    shares = [s.decided_s / s.driving_s for s in wheels if s.driving_s > 0]
    least = f", each for {_least(min(shares))} of its driving" if shares else ""
    return f"All {len(wheels)} wheel parts were judged{least}{how}."


def headline(report: Mapping[str, Any]) -> tuple[str, str]:
    """Verdict in a word or two, and whether the machine may go out; the latter empty where the former says it.

    Faults to watch give leave only where every wheel part was judged long enough and nothing of the log is lost; see
    `diagnosis.decision.decide`.
    """
    verdict = report.get("verdict") or {}
    status = verdict.get("status", "not_assessed")
    if status != "watch":
        return VERDICTS.get(status, VERDICTS["not_assessed"])[1], _ANSWERS.get(status, _ANSWERS["not_assessed"])
    doubt = str(verdict.get("not_cleared") or "") or ("" if verdict.get("cleared") else _doubt(report))
    if doubt:
        return VERDICTS["watch"][1], f"not cleared: {doubt}"
    return "Ready, with faults to watch", "may go out"


def _doubt(report: Mapping[str, Any]) -> str:
    """Why a report that does not say so itself gives no leave to go out."""
    if any(f.get("damage") for f in (report.get("log") or {}).get("files") or ()):
        return "the log is damaged"
    axles = (report.get("machine") or {}).get("axles") or ()
    wheels = [s for (c, _), s in known_sides(report).items() if c not in axles]
    short = sum(not s.assessed for s in wheels)
    if short:
        return f"{short} part{'s were' if short > 1 else ' was'} not judged long enough"
    return "" if wheels else "how long its parts were judged is not known"


def known_sides(report: Mapping[str, Any]) -> Mapping[tuple[str, str], SideCoverage]:
    """How long each component and side was judged; empty where a report does not say it."""
    rows: Sequence[Mapping[str, Any]] = report.get("coverage") or ()
    if not rows or not all("decided_driving_s" in row and "seconds" in row for row in rows):
        return {}
    whole: Any = {"limits": {"min_assessed": 10.0}, **completed(dict(report))}
    return sides_of(whole)


def _share(x: float) -> str:
    return "all" if x >= 1 else f"{min(99.0, 100 * x):.0f} %"


def _least(x: float) -> str:
    return "all" if x >= 1 else f"at least {_share(x)}"
