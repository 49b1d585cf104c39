"""How often Python looks for objects in cycles.

Modules and the compiler make objects by the hundred thousand, hardly any of them in cycles and nearly all of them to stay.
"""

from __future__ import annotations

import gc

# objects, and rounds of the younger generations, between two searches: while modules are loaded, and afterwards
_LOADING, _WORKING = (300_000, 10, 10), (50_000, 10, 10)


def collect_little() -> None:
    """Look seldom, for a program of its own: looking after every 700 objects took a seventh of a first run."""
    gc.set_threshold(*_LOADING)


def all_loaded() -> None:
    """Where `collect_little` was called: look at none of the objects that there are any more, and more often at those to come."""
    if gc.get_threshold() == _LOADING:
        gc.freeze()
        gc.set_threshold(*_WORKING)
