"""Read damaged inputs of every format for a time; run as `python tests/benchmarks/fuzz.py --minutes 10`.

Inputs are made from a seed and a number: sound ones, damaged where their format has records, fields, lengths and checksums
(which are made right again or not), or anywhere. Each is read as users read it. A finding is

- `foreign`: an error that is not the project's, also one that the border around the readers turned into a sentence;
- `crash`, `hang`: the interpreter dies; reading takes more than 10 s of a processor (the compiler's time is not counted);
- `waited`: the worker sleeps for ten minutes. Time in which the machine does other work counts for neither;
- `memory`: it takes more than 256 MB and four times the input;
- `silent`: less, more or other than what was written, or than what another library reads without an error (mcap, rosbags,
  sqlite3, pandas, pyarrow), and nothing says so, although a checksum or a count does;
- `shape`: what comes out is no log, or the message names no file.

Findings are printed and kept as files in `--out`, with seed, number and traceback; the run goes on. How far it is is said every half minute, and
kept in the file that `--progress` names. At the end comes a table, also where Ctrl-C or SIGTERM ended the run. The exit code is 1 where anything was found. `--repeat FORMAT:SEED:NUMBER` reads one input again and prints all about it.

`NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(mktemp -d) python tests/benchmarks/fuzz.py` checks every index of the compiled kernels; the
first inputs then wait for the compiler.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from replay.arrays.kernel_cache import drop_stale_kernels  # noqa: E402
from replay.readers.registry import load_readers  # noqa: E402
from tests.benchmarks.fuzzing.formats import TARGETS  # noqa: E402
from tests.benchmarks.fuzzing.pool import Pool  # noqa: E402
from tests.benchmarks.fuzzing.tally import Progress, cpu, table  # noqa: E402
from tests.benchmarks.fuzzing.worker import input_of, lay_out, sound_samples, tried  # noqa: E402


def again(words: str) -> int:
    """Read one input again, in this process."""
    name, seed, number = words.split(":")
    target = TARGETS[name]()
    with tempfile.TemporaryDirectory() as folder:
        (place := Path(folder) / "corpus").mkdir()
        sample, case, source = input_of(target, sound_samples(target, place), int(seed), int(number))
        path = lay_out(sample, case, Path(folder) / "input")
        answer = tried(target, sample, case, source, path)
    for key, value in answer.items():
        print(f"{key}: {value}")
    return 1 if answer["kind"] else 0


def main() -> int:
    """Run and print the table; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--format", action="append", choices=list(TARGETS), help="one format; may be given again")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the run (default: the time)")
    parser.add_argument("--first", type=int, default=0, help="number of the first input of each format")
    parser.add_argument("--inputs", type=int, default=10**9, help="most inputs of each format")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--out", type=Path, default=Path(tempfile.gettempdir()) / "mfhca-fuzz", help="folder of findings"
    )
    parser.add_argument("--progress", type=Path, metavar="FILE", help="JSON file of the counts so far, always whole")
    parser.add_argument("--every", type=float, default=30.0, help="between two lines of progress [s]; 0: none")
    parser.add_argument("--repeat", metavar="FORMAT:SEED:NUMBER")
    choice = parser.parse_args()
    drop_stale_kernels([ROOT / "replay", ROOT / "diagnosis"], ROOT / "replay" / "__pycache__" / "kernels.json")
    if choice.repeat:
        return again(choice.repeat)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # so that its folder is removed
    load_readers()
    choice.out.mkdir(parents=True, exist_ok=True)
    print(f"seed {choice.seed}", flush=True)
    shared = Path("/dev/shm")  # many small files: in memory where that can be
    with tempfile.TemporaryDirectory(
        prefix="mfhca-fuzz-", dir=shared if os.access(shared, os.W_OK) else None
    ) as folder:
        names = choice.format or list(TARGETS)
        pool = Pool(names, choice.seed, choice.first, Path(folder), choice.out, choice.jobs)
        for outside in (signal.SIGINT, signal.SIGTERM):
            signal.signal(outside, lambda *_: pool.stop())
        said = Progress(
            choice.every, choice.progress, {"seed": choice.seed, "first": choice.first, "jobs": choice.jobs}
        )
        state = "failed"
        try:
            pool.run(choice.minutes * 60, choice.inputs, lambda: said.tell(pool.scores, pool.cpu_s))
            state = "stopped" if pool.stopped else "complete"
        finally:
            said.tell(pool.scores, pool.cpu_s, state)
            print(table(pool.scores))
    print(f"{cpu(pool.scores) / 3600:.2f} h of a processor in the readers, {pool.cpu_s() / 3600:.2f} h in all")
    found = {name: score.findings for name, score in pool.scores.items() if score.findings}
    for name, marks in found.items():
        for mark, count in marks.most_common():
            print(f"{name}: {count} × {mark}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
