"""Read damaged inputs of every format for a time; run as `python tests/benchmarks/fuzz.py --minutes 10`.

Inputs are made from a seed and a number: sound ones, damaged where their format has records, fields, lengths and checksums
(which are made right again or not), or anywhere. Each is read as users read it. A finding is

- `foreign`: an error that is not the project's, also one that the border around the readers turned into a sentence;
- `crash`, `hang`: the interpreter dies; reading takes more than 10 s of a processor;
- `memory`: it takes more than 256 MB and four times the input;
- `silent`: less, more or other than what was written, or than what another library reads without an error (mcap, rosbags,
  sqlite3, pandas, pyarrow), and nothing says so, although a checksum or a count does;
- `shape`: what comes out is no log, or the message names no file.

Findings are printed and kept as files in `--out`, with seed, number and traceback; the run goes on. At the end comes a table.
The exit code is 1 where anything was found. `--repeat FORMAT:SEED:NUMBER` reads one input again and prints all about it.

`NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(mktemp -d) python tests/benchmarks/fuzz.py` checks every index of the compiled kernels; the
first inputs then wait for the compiler.
"""

from __future__ import annotations

import argparse
import os
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
from tests.benchmarks.fuzzing.pool import Pool, Score  # noqa: E402
from tests.benchmarks.fuzzing.worker import input_of, lay_out, sound_samples, tried  # noqa: E402


def table(scores: dict[str, Score]) -> str:
    """What was counted, a line for each format."""
    words = sorted({word for score in scores.values() for word in score.outcomes}, key=lambda w: (w in _BAD, w))
    head = f"{'format':12}{'inputs':>9}" + "".join(f"{word:>10}" for word in words) + f"{'CPU s':>9}{'slowest':>9}"
    lines = [head]
    for name, score in scores.items():
        cells = "".join(f"{score.outcomes[word]:10}" for word in words)
        lines.append(f"{name:12}{score.inputs:9}{cells}{score.cpu_s:9.1f}{score.slowest_s:9.2f}")
    total = sum(score.inputs for score in scores.values())
    return "\n".join([*lines, f"{'all':12}{total:9}"])


_BAD = ("foreign", "crash", "hang", "memory", "silent", "shape", "peer")


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
    parser.add_argument("--repeat", metavar="FORMAT:SEED:NUMBER")
    choice = parser.parse_args()
    drop_stale_kernels([ROOT / "replay", ROOT / "diagnosis"], ROOT / "replay" / "__pycache__" / "kernels.json")
    if choice.repeat:
        return again(choice.repeat)
    load_readers()
    choice.out.mkdir(parents=True, exist_ok=True)
    print(f"seed {choice.seed}", flush=True)
    shared = Path("/dev/shm")  # many small files: in memory where that can be
    with tempfile.TemporaryDirectory(
        prefix="mfhca-fuzz-", dir=shared if os.access(shared, os.W_OK) else None
    ) as folder:
        names = choice.format or list(TARGETS)
        pool = Pool(names, choice.seed, choice.first, Path(folder), choice.out, choice.jobs)
        pool.run(choice.minutes * 60, choice.inputs)
    print(table(pool.scores))
    found = {name: score.findings for name, score in pool.scores.items() if score.findings}
    for name, marks in found.items():
        for mark, count in marks.most_common():
            print(f"{name}: {count} × {mark}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
