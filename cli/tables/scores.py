"""Scores of an evaluation as tables of the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from cli.tables.layout import key_values, section, table, text
from cli.tables.looks import mode_text
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import ANY_DRIVE

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from diagnosis.evaluation.counts import Counts
    from diagnosis.evaluation.document import (
        AllFigures,
        BandFigures,
        Figures,
        ModeFigures,
        ProbabilityBin,
        Reliability,
        SideFigures,
        Spread,
    )
    from diagnosis.evaluation.evaluate import MissionScores

_GROUPS = {"wheel": "Wheels", "steer": "Steering"}
_SHOWN = 20


def score_parts(
    names: Sequence[str], scores: Sequence[MissionScores], pooled: Mapping[str, Figures]
) -> list[RenderableType]:
    """Tables of all missions together; before them a line per mission, or what was not right in the only one."""
    parts: list[RenderableType] = []
    if len(scores) > 1:
        parts += [section("Missions"), _missions(names, scores)]
    for group, figures in pooled.items():
        title = _GROUPS[group]
        if _empty(figures):
            parts.append(section(f"{title}: nothing decided, no fault injected or reported"))
            continue
        parts += [section(f"{title}: states over driving time"), _states(figures["sides"])]
        for side, values in figures["sides"].items():
            parts += [section(f"{title}, {side}: true row against reported [s]"), _confusion(side, values)]
        if figures["events"]["faults"] or figures["events"]["reported"]:
            parts += [section(f"{title}: faults"), _events(figures)]
        if figures["modes"]:
            parts += ["", _modes(figures["modes"])]
        if figures["events"]["faults"] or figures["events"]["masked"]:
            parts += [section(f"{title}: by severity and excitation"), _divided(figures)]
        if len(scores) == 1 and (wrong := _wrong(group, scores[0].groups[group])) is not None:
            parts += [section(f"{title}: not right"), wrong]
        if any(b["reported"] for b in figures["calibration"]):
            parts += [section(f"{title}: stated probability"), _calibration(figures["calibration"])]
            parts += ["", _reliability(figures["reliability"])]
    return [*parts, ""]


def _empty(figures: Figures) -> bool:
    events = figures["events"]
    decided = any(side["decided_share"] for side in figures["sides"].values())
    return not decided and not events["faults"] and not events["reported"]


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{value * 1e3:.0f} ms"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _mode(name: str, side: str) -> Text:
    return mode_text(name, state_label(name, side).lower())


def _missions(names: Sequence[str], scores: Sequence[MissionScores]) -> Table:
    from diagnosis.evaluation.scores import figures

    rows = []
    for name, score in zip(names, scores, strict=True):
        found = figures(score.groups["wheel"])
        events, sides = found["events"], found["sides"]
        rows.append(
            (
                name,
                events["faults"],
                events["right"],
                events["reported"],
                found["false_alarms"]["count"],
                *(_share(sides[s][k]) for s in ("sensor", "actuator") for k in ("macro_f1", "balanced_accuracy")),
            )
        )
    headings = (
        "wheels of",
        "faults",
        "right",
        "reported",
        "false alarms",
        "sensor F1",
        "bal. acc.",
        "actuator F1",
        "bal. acc.",
    )
    return table(headings, rows, right=range(1, 9))


def _states(sides: Mapping[str, SideFigures]) -> Table:
    rows = [
        (
            side,
            f"{s['driving_s']:.1f}",
            _share(s["macro_f1"]),
            _share(s["balanced_accuracy"]),
            _share(s["balanced_accuracy_decided"]),
            _share(s["decided_share"]),
            *(_share(s["damadics"][k]) for k in ("r_td", "r_fd", "r_ti", "r_fi")),
        )
        for side, s in sides.items()
    ]
    headings = ("", "driving [s]", "macro-F1", "balanced accuracy", "of decided time", "decided share")
    return table((*headings, "r_td", "r_fd", "r_ti", "r_fi"), rows, right=range(1, 10))


def _confusion(side: str, found: SideFigures) -> Table:
    rows = []
    for name, seconds in zip(found["true"], found["seconds"], strict=True):
        if not sum(seconds):
            continue
        cells = [
            text(f"{s:.1f}" if s >= 0.05 else "·", _cell(name, other, s))
            for other, s in zip(found["reported"], seconds, strict=True)
        ]
        rows.append((_mode(name, side), *cells, _share(found["rows"][name]["recall"])))
    headings = ("true", *(state_label(c, side).lower() for c in found["reported"]), "recall")
    return table(headings, rows, right=range(1, len(headings)))


def _cell(true: str, reported: str, seconds: float) -> str:
    if seconds < 0.05 or reported == "undecided":
        return "dim"
    return "bold" if true == reported else "bold red"


def _events(figures: Figures) -> Table:
    events, alarms, epsilon = figures["events"], figures["false_alarms"], figures["epsilon"]
    counts = ", ".join(
        f"{number} {words}"
        for number, words in (
            (events["right"], "right"),
            (events["wrong_mode"], "wrong row"),
            (events["wrong_side"], "wrong side"),
            (events["wrong_part"], "wrong part"),
            (events["missed"], "missed"),
        )
    )
    uncounted = ((events["not_excited"], "not excited"), (events["masked"], "masked"))
    apart = ", ".join(f"{number} {words}" for number, words in uncounted if number)
    rows: list[tuple[str, object]] = [
        ("injected", f"{events['faults']}: {counts}" + (f" (not counted: {apart})" if apart else "")),
        ("reported", f"{events['reported']}, of them {events['surplus']} without a matching fault"),
        (
            "one to one",
            f"precision {_share(events['precision'])}, recall {_share(events['recall'])}, F1 {_share(events['f1'])}",
        ),
        (
            "isolation",
            f"{_share(events['isolation_rate'])} of {events['detected']} detected, right row too "
            f"{_share(events['identification_rate'])}, wrong part {_share(events['wrong_wheel_rate'])}",
        ),
    ]
    delay = figures["detection_delay_s"]
    unknown = f"; {delay['without']} without a known moment" if delay["without"] else ""
    spreads: tuple[tuple[str, Spread, str], ...] = (
        ("onset error", figures["onset_error_s"], ""),
        ("delay", delay, unknown),
        ("end error", figures["end_error_s"], ""),
    )
    for name, e, more in spreads:
        rows.append((name, f"median {_ms(e['median'])}, p95 {_ms(e['p95'])} over {e['n']} faults{more}"))
    rows.append(
        (
            "ε error",
            f"mean {_share(epsilon['mae'])} over {epsilon['n']} faults, {_share(epsilon['mae_partial'])} over the "
            f"{epsilon['n_partial']} partial ones (0 < ε < 1); {epsilon['without']} without ε̂",
        )
    )
    if alarms["per_hour"] is not None:
        rows.append(
            (
                "false alarms",
                f"{alarms['count']} in {alarms['healthy_h']:.3f} healthy hours: {alarms['per_hour']:.3g} per hour, at most "
                f"{alarms['per_hour_high']:.3g} (95 %); {alarms['info']} more of severity info",
            )
        )
    return key_values(rows)


def _modes(modes: Sequence[ModeFigures]) -> Table:
    rows = [
        (
            m["side"],
            _mode(m["mode"], m["side"]),
            m["faults"],
            m["right"],
            _share(m["recall"]),
            _share(m["epsilon_mae"]),
            _ms(m["onset_error_s"]["median"]),
            _ms(m["onset_error_s"]["p95"]),
            _ms(m["detection_delay_s"]["median"]),
            _ms(m["detection_delay_s"]["p95"]),
        )
        for m in modes
    ]
    headings = ("side", "row", "faults", "right", "recall", "ε error", "onset median", "p95", "delay median", "p95")
    return table(headings, rows, right=range(2, 10))


def _divided(figures: Figures) -> Table:
    """One line per band of ε, of commanded speed and of tyre contact."""
    bands = [(f"ε {_band(b)}", b) for b in figures["by_epsilon"] if b["events"]["faults"]]
    bands += [(f"{_band(b)} m/s", b) for b in figures["by_speed"]]
    rows = [_divided_row(name, b) for name, b in bands]
    rows += [_divided_row(b["contact"], b) for b in figures["by_contact"]]
    headings = ("", "faults", "recall", "prec.", "isolated", "wrong", "delay p95", "ε error", "alarms")
    return table((*headings, "sensor F1", "undec.", "act. F1", "undec."), rows, right=range(1, 13))


def _band(band: BandFigures) -> str:
    return f"≥ {band['low']:g}" if band["high"] is None else f"{band['low']:g}–{band['high']:g}"


def _divided_row(name: str, band: AllFigures) -> tuple[object, ...]:
    events, sensor, actuator = band["events"], band["sides"]["sensor"], band["sides"]["actuator"]
    return (
        name,
        events["masked"] if name == "masked" else events["faults"],
        _share(events["recall"]),
        _share(events["precision"]),
        _share(events["isolation_rate"]),
        _share(events["wrong_wheel_rate"]),
        _ms(band["detection_delay_s"]["p95"]),
        _share(band["epsilon"]["mae"]),
        band["false_alarms"]["count"],
        _share(sensor["macro_f1"]),
        _share(sensor["undecided_share"]),
        _share(actuator["macro_f1"]),
        _share(actuator["undecided_share"]),
    )


def _wrong(kind: str, counts: Counts) -> Table | None:
    """Faults that were not found as they are, and reports without a fault of their own, by time."""
    wrong = [
        (f.start_s, f.stop_s, f.component, f.side, f.mode, _words(f.outcome), f.report)
        for f in counts.faults
        if f.outcome in ("wrong_mode", "wrong_side", "wrong_part", "missed")
    ]
    wrong += [
        (r.start_s, r.stop_s, r.component, r.side, r.mode, "false alarm" if r.false_alarm else "surplus", r.id)
        for r in counts.reports
        if r.outcome == "surplus"
    ]
    if not wrong:
        return None
    rows = [
        (f"{a:.2f}–{b:.2f}", ANY_DRIVE.part_words(kind, component, side), _mode(mode, side), what, report)
        for a, b, component, side, mode, what, report in sorted(wrong)[:_SHOWN]
    ]
    if len(wrong) > _SHOWN:
        rows.append((f"and {len(wrong) - _SHOWN} more (--json)", "", text(""), "", ""))
    return table(("time [s]", "part", "row", "what", "report"), rows)


def _calibration(bins: Sequence[ProbabilityBin]) -> Table:
    rows = [
        (f"{b['low']:.1f}–{b['high']:.1f}", b["reported"], _share(b["probability"]), _share(b["right"]))
        for b in bins
        if b["reported"]
    ]
    return table(("bin", "reported", "stated", "right"), rows, right=range(4))


def _reliability(groups: Sequence[Reliability]) -> Table:
    rows = [
        (g["tier"], _words(g["side"]), g["reported"], g["right"], _share(g["brier"]), _share(g["ece"])) for g in groups
    ]
    return table(("tier", "side", "reported", "right", "Brier", "ECE"), rows, right=range(2, 6))
