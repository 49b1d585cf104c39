"""Compare diagnoses with the truth of simulated and injected missions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from diagnosis.api.errors import stated
from diagnosis.api.inputs import MachineLike, StrPath, check_output, machine_given, path_of, paths_of
from diagnosis.api.result import Diagnosis
from diagnosis.api.saved_results import saved_report
from diagnosis.api.truths import results_and_truths
from replay.errors import ConfigError
from replay.progress import Subscriber, silent

if TYPE_CHECKING:
    import pandas as pd

    from diagnosis.evaluation.document import Figures, ScoresDocument
    from diagnosis.evaluation.evaluate import MissionScores
    from diagnosis.evaluation.excitation import Speeds
    from diagnosis.results.document import ReportDocument

#: A diagnosis in memory, or the path of a report or log.
Result: TypeAlias = "Diagnosis | StrPath"

_SIDES = ("driving_s", "macro_f1", "balanced_accuracy", "balanced_accuracy_decided", "decided_share", "undecided_share")


@dataclass(frozen=True)
class Evaluation:
    """How diagnoses compare with the truth; ``docs/how-to/own-faults.md`` defines every figure.

    Attributes
    ----------
    pairs : tuple[tuple[str, str], ...]
        Result and truth file of each mission.
    scores : tuple[MissionScores, ...]
        Counts of each mission.
    pooled : Mapping[str, Figures]
        Figures of all missions together, of ``wheel`` and ``steer``.
    """

    pairs: tuple[tuple[str, str], ...]
    scores: tuple[MissionScores, ...]
    pooled: Mapping[str, Figures]

    def __repr__(self) -> str:
        found = [fault for one in self.scores for group in one.groups.values() for fault in group.faults]
        right = sum(fault.outcome == "right" for fault in found)
        count = len(self.scores)
        return f"<Evaluation of {count} mission{'s' * (count != 1)}: {right} of {len(found)} injected faults right>"

    @cached_property
    def document(self) -> ScoresDocument:
        """Everything, as `mfhca evaluate --json` prints it."""
        from diagnosis.evaluation.scores import scores_document

        return scores_document(self.pairs, self.scores, self.pooled)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not scored, and why, one sentence each."""
        out = []
        for (name, _), mission in zip(self.pairs, self.scores, strict=True):
            if mission.left_out:
                verb = "is" if len(mission.left_out) == 1 else "are"
                out.append(f"{name}: {', '.join(mission.left_out)} {verb} not in the result and not scored")
            if mission.not_driven:
                faults = "; ".join(mission.not_driven)
                out.append(f"{name}: the truth has faults outside of driving, where nothing can show them: {faults}")
        return tuple(out)

    @property
    def sides(self) -> pd.DataFrame:
        """States over driving time, shape (2 or 4, 6), indexed by ``group`` (``wheel``, ``steer``) and ``side``.

        ``driving_s`` [s]; ``macro_f1``, ``balanced_accuracy`` (undecided time is wrong), ``balanced_accuracy_decided``,
        ``decided_share``, ``undecided_share`` [1]; NaN where there is nothing to divide by.
        """
        import pandas as pd

        rows = {(g, s): dict(row) for g, f in self.pooled.items() for s, row in f["sides"].items()}
        index = pd.MultiIndex.from_tuples(list(rows), names=["group", "side"])
        return pd.DataFrame(list(rows.values()), index=index, columns=list(_SIDES), dtype="float64")

    @property
    def events(self) -> pd.DataFrame:
        """Faults one to one, shape (1 or 2, figures), indexed by ``group``.

        Counts and rates of ``events`` (precision, recall, f1, isolation rate [1] …), ``false_alarms`` and
        ``false_alarms_per_hour`` with its upper 95 % bound ``false_alarms_per_hour_high`` [1/h], ``healthy_h`` [h],
        ``onset_error_s`` and ``detection_delay_s`` (medians [s]), ``epsilon_mae`` [1].
        """
        import pandas as pd

        rows = {
            group: {
                **f["events"],
                "false_alarms": f["false_alarms"]["count"],
                "false_alarms_per_hour": f["false_alarms"]["per_hour"],
                "false_alarms_per_hour_high": f["false_alarms"]["per_hour_high"],
                "healthy_h": f["false_alarms"]["healthy_h"],
                "onset_error_s": f["onset_error_s"]["median"],
                "detection_delay_s": f["detection_delay_s"]["median"],
                "epsilon_mae": f["epsilon"]["mae"],
            }
            for group, f in self.pooled.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index", dtype="float64").rename_axis("group")

    @property
    def faults(self) -> pd.DataFrame:
        """What became of each injected fault, shape (faults, 19).

        ``result``, ``group``; ``component``, ``side``, ``mode``, ``start_s``, ``stop_s`` [s]; ``epsilon``,
        ``driving_share``, ``overlap``, ``slip_share``, ``epsilon_error`` [1]; ``outcome`` (``right``, or what was wrong);
        ``report`` (name of the reported fault); ``onset_error_s``, ``end_error_s``, ``detection_delay_s`` [s]; ``speed``
        (commanded [m/s]); ``onset_seen``.
        """
        from diagnosis.evaluation.document import FaultRow

        return self._listed("faults", list(FaultRow.__annotations__))

    @property
    def reported(self) -> pd.DataFrame:
        """What each reported fault was worth, shape (reported, 17).

        ``result``, ``group``; ``id``, ``component``, ``side``, ``mode``, ``severity``, ``tier``; ``start_s``, ``stop_s`` [s];
        ``probability``, ``epsilon``, ``slip_share`` [1]; ``speed`` [m/s]; ``outcome``; ``false_alarm``; ``bounds_hold``.
        """
        from diagnosis.evaluation.document import ReportRow

        return self._listed("reported", list(ReportRow.__annotations__))

    def _listed(self, key: str, columns: Sequence[str]) -> pd.DataFrame:
        import pandas as pd

        rows = [
            {"result": row["result"], "group": group, **item}
            for row in self.document["results"]
            for group in ("wheel", "steer")
            for item in row.get(group, {}).get(key, ())  # type: ignore[attr-defined]
        ]
        return pd.DataFrame(rows, columns=["result", "group", *columns])

    @stated
    def save(self, page: StrPath) -> Path:
        """Write all figures as one page without scripts.

        Parameters
        ----------
        page : str or Path
            File to write, replaced where it is there.

        Raises
        ------
        ConfigError
            Where it is one of the results or truth files.
        OutputError
            Where it cannot be written.
        """
        from diagnosis.evaluation.page import build_scores_page
        from replay.atomic_write import atomic_path

        place = path_of(page)
        check_output([place], [path for pair in self.pairs for path in map(Path, pair) if path.is_file()])
        text = build_scores_page(self.document)
        with atomic_path(place) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
        return place


@stated
def evaluate(
    results: Result | Iterable[Result],
    truth: StrPath | None = None,
    *,
    machine: MachineLike = None,
    progress: Subscriber = silent,
) -> Evaluation:
    """Score results against the truth, as `mfhca evaluate` does.

    Parameters
    ----------
    results : Diagnosis, str, Path or several
        A diagnosis in memory, report folders, ``report.json`` files, logs (diagnosed first), or folders of them.
    truth : str, Path or None
        Truth of the one result; None: found beside the log or report. A diagnosis in memory needs it.
    machine : str, Path, Machine or None
        Machine of logs that are diagnosed first; None: the paper's.
    progress : Callable[[Progress], None]
        Called at the beginning of each stage.

    Raises
    ------
    ConfigError
        Where a truth is missing, or is that of another mission or machine.
    LogError
        Where a result or log cannot be read.
    """
    if isinstance(results, Diagnosis):
        results = [results]
    elif not isinstance(results, str) and isinstance(results, Iterable):
        results = list(results)
    if isinstance(results, list) and any(isinstance(r, Diagnosis) for r in results):
        if len(results) > 1 or truth is None:
            raise ConfigError(
                "a diagnosis in memory is scored by itself, with its truth: give truth, the path of its file"
            )
        return score([(results[0], path_of(truth))], machine, progress)
    words = paths_of(results)  # type: ignore[arg-type]
    return score(results_and_truths(words, None if truth is None else path_of(truth)), machine, progress)


def score(
    pairs: Sequence[tuple[Diagnosis | Path, Path]], machine: MachineLike = None, progress: Subscriber = silent
) -> Evaluation:
    """Score pairs of a result and its truth file; see `evaluate`.

    Parameters
    ----------
    pairs : Sequence[tuple[Diagnosis or Path, Path]]
        Results, or paths of reports and logs, each with its truth file.
    machine : str, Path, Machine or None
        Machine of logs that are diagnosed first.
    progress : Callable[[Progress], None]
        Called at the beginning of each stage.

    Raises
    ------
    ConfigError, LogError
        See `evaluate`.
    """
    from diagnosis.evaluation.counts import add
    from diagnosis.evaluation.evaluate import evaluate_report
    from diagnosis.evaluation.scores import figures
    from replay.truth import read_truth

    scores, names = [], []
    for result, file in pairs:
        mission = read_truth(file)
        report, speeds = _result_of(result, machine, mission.wheels, progress)
        name = str(result) if isinstance(result, Path) else "the diagnosis"
        scores.append(evaluate_report(report, mission, name, speeds=speeds))
        names.append((name, str(file)))
    groups = [g for g in ("wheel", "steer") if any(g in s.groups for s in scores)]
    pooled = {g: figures(add([s.groups[g] for s in scores if g in s.groups])) for g in groups}
    return Evaluation(tuple(names), tuple(scores), pooled)


def _result_of(
    result: Diagnosis | Path, machine: MachineLike, wheels: tuple[str, ...], progress: Subscriber
) -> tuple[ReportDocument, Speeds | None]:
    """A report in memory, a saved one, or the one of a log, and the commanded speeds beside it."""
    from diagnosis.evaluation.excitation import read_speeds, speeds_of
    from diagnosis.output import PARQUET, load_report

    if isinstance(result, Diagnosis):
        return result.report, speeds_of(result.columns, wheels)
    saved = saved_report(result)
    if saved is not None:
        return load_report(saved), read_speeds(saved.with_name(PARQUET), wheels)
    from diagnosis.pipeline import diagnose

    the_machine, source = machine_given(machine)
    found = diagnose(
        [result],
        the_machine,
        machine_source=source,
        progress=lambda event: progress(replace(event, mission=result.name)),
    )
    return found.report, speeds_of(found.columns, wheels)
