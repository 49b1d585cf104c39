"""What a drive valve that has lost a quarter, or all, leaves in the speeds of each machine of `all_clear.py`: `python tests/benchmarks/weak_valves.py`.

The same mission with and without the fault, from 30 s to 50 s. Per machine, by the median of some seeds: the wheel's speed as a share of what it was,
and ln of its speed per opening beside the other wheels', which a loss of a quarter would lower by 0.288 if nothing carried the wheel and
its loop made up for all of it. What is less than healthy wheels differ by cannot be seen by commands and speeds.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from types import ModuleType

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from all_clear import OTHERS

from replay.faults import FaultMode, FaultSpec, Side
from replay.signals.signal import Signals

WHEEL, OTHER = "FR", ("FL", "RR", "RL")
START_S, STOP_S, SETTLED_S = 30.0, 50.0, 2.0
_DRIVEN, _OPEN = 0.1, 0.03  # m/s, of full opening
Array = np.ndarray


def means(signals: Signals, name: str, when: Array) -> Array:
    """A signal at some seconds of the mission."""
    one = signals.items[name]
    return np.interp(when, (one.stamps - one.stamps[0]) * 1e-9, one.values)


def left(physics: ModuleType, seed: int, epsilon: float) -> tuple[float, float] | None:
    """Speed of the wheel as a share of what it was, and ln of speed per opening beside the others'; None where it is not driven."""
    mode = FaultMode.NO_SIGNAL if epsilon == 1.0 else FaultMode.INEFFICIENT
    fault = FaultSpec(WHEEL, Side.ACTUATOR, mode, START_S, STOP_S, epsilon)
    sound, ill = (physics.signals(seed, faults, 75.0, "base") for faults in ((), (fault,)))
    when = np.arange(START_S + SETTLED_S, STOP_S, 0.05)
    use = np.abs(means(sound, f"wheel.{WHEEL}.v", when)) > _DRIVEN
    per: dict[str, float] = {}
    for wheel in (WHEEL, *OTHER):
        v, u = (np.abs(means(ill, f"wheel.{wheel}.{leaf}", when)) for leaf in "vu")
        was, before = (np.abs(means(sound, f"wheel.{wheel}.{leaf}", when)) for leaf in "vu")
        both = use & (before > _OPEN)
        if np.count_nonzero(both) < 40:
            return None
        per[wheel] = float(
            np.log(max(v[both].sum(), 1e-9) / u[both].sum()) - np.log(was[both].sum() / before[both].sum())
        )
        if wheel == WHEEL:
            share = float(np.median(v[both] / np.maximum(was[both], 1e-9)))
    return share, per[WHEEL] - float(np.median([per[w] for w in OTHER]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1100, help="first seed")
    parser.add_argument("--count", type=int, default=6, help="seeds of each machine")
    args = parser.parse_args()
    for name, physics in OTHERS.items():
        for epsilon in (0.25, 1.0):
            seen = [
                x for s in range(args.first, args.first + args.count) if (x := left(physics, s, epsilon)) is not None
            ]
            shares, beside = np.array(seen).T
            print(
                f"{name:18}{epsilon:5.2f} lost: speed × {np.median(shares):.2f} ({shares.min():.2f} to {shares.max():.2f}), "
                f"speed per opening {np.median(beside):+.3f} ({beside.min():+.3f} to {beside.max():+.3f}), {len(seen)} missions",
                flush=True,
            )


if __name__ == "__main__":
    main()
