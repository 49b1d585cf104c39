"""Which wheel or steering axle a recorded name speaks of."""

from __future__ import annotations

import re
from collections.abc import Iterable

from replay.machine.config import Machine
from replay.machine.geometry import own_axle
from replay.signals.name_words import apart, tokens
from replay.signals.named_units import bare_name

_LONG = {
    "front": "front", "fore": "front", "fwd": "front", "vorne": "front", "vorn": "front",
    "rear": "rear", "back": "rear", "aft": "rear", "hinten": "rear",
    "frnt": "front", "lft": "left", "rgt": "right", "rght": "right",
    "left": "left", "links": "left", "right": "right", "rechts": "right",
    "middle": "middle", "mid": "middle", "center": "middle", "centre": "middle", "mitte": "middle", "mittig": "middle",
    "vorder": "front", "va": "front", "hinter": "rear", "ha": "rear", "av": "front", "ar": "rear", "li": "left", "re": "right",
    "avant": "front", "arriere": "rear", "gauche": "left", "droite": "right", "droit": "right",
    "delantera": "front", "delantero": "front", "trasera": "rear", "trasero": "rear", "izquierda": "left", "izquierdo": "left",
    "izq": "left", "derecha": "right", "derecho": "right", "central": "middle", "centrale": "middle",
    "anteriore": "front", "posteriore": "rear", "sinistra": "left", "sinistro": "left", "sx": "left", "destra": "right",
    "destro": "right", "dx": "right", "dianteira": "front", "dianteiro": "front", "traseira": "rear", "traseiro": "rear",
    "voor": "front", "achter": "rear", "fram": "front", "bak": "rear", "vanster": "left", "vaenster": "left", "hoger": "right",
    "hoeger": "right", "foran": "front", "bagest": "rear", "venstre": "left", "hojre": "right", "hoejre": "right", "hoyre": "right",
    "hoeyre": "right", "etu": "front", "taka": "rear", "vasen": "left", "oikea": "right", "przednie": "front", "przedni": "front",
    "przednia": "front", "przod": "front", "tylne": "rear", "tylny": "rear", "tylna": "rear", "tyl": "rear", "lewe": "left",
    "lewy": "left", "lewa": "left", "prawe": "right", "prawy": "right", "prawa": "right", "tras": "rear",
    "esquerda": "left", "esquerdo": "left", "direita": "right", "direito": "right", "meio": "middle", "milieu": "middle",
}  # fmt: skip
_PAIRS = {
    "fl": ("front", "left"), "lf": ("front", "left"), "fr": ("front", "right"), "rf": ("front", "right"),
    "rl": ("rear", "left"), "lr": ("rear", "left"), "bl": ("rear", "left"), "lb": ("rear", "left"),
    "rr": ("rear", "right"), "br": ("rear", "right"), "rb": ("rear", "right"),
    "ml": ("middle", "left"), "mr": ("middle", "right"), "lm": ("middle", "left"), "rm": ("middle", "right"),
    "avg": ("front", "left"), "avd": ("front", "right"), "arg": ("rear", "left"), "ard": ("rear", "right"),
    "vl": ("front", "left"), "vr": ("front", "right"), "hl": ("rear", "left"), "hr": ("rear", "right"),
}  # fmt: skip
_ANGLES = frozenset(("winkel", "angle", "ang", "phi"))
_OF_STEERING = _ANGLES | {"valve", "vlv", "ventil"}  # beside which str is no text, but steering
_FRENCH = frozenset(("av", "ar", "avant", "arriere"))
_STEER = re.compile(r"steer|lenk|kingpin|azimuth|swivel|knuckle|braquage|sterz|direccion(?!al)")
_DRIVE = re.compile(
    r"wheel|drive|(?<![a-z])drv|motor|rad(?![a-z]|_?s(?![a-z])|/)|traction|hub|antrieb|roue|moteur|rueda|ruota|roda(?![a-z])|"
    r"wiel|hjul|pyora|pyoera|(?<![a-z])kolo(?![a-z])|"
    r"(?<![a-z0-9])[wm]\d(?![a-z0-9])"  # w0_rpm, m1_speed
)
_LOOSE = re.compile(r"(?<![A-Za-z0-9])[fblr](?![A-Za-z0-9])")
_SIDE_AT_END = re.compile(r"(?<=[a-z])([LR])(?![A-Za-z])")  # encL, speedR
_NO_DRIVE = re.compile(r"castor|caster|arm|grip|finger|flipper|head|neck|elbow|shoulder|wrist|hip|knee|lift|torso")
_MOST_ROWS = 10  # axles
_AXLE = frozenset(("a", "ax", "axle", "achse", "achs", "essieu"))
_INDEX = re.compile(r"\[(\d+)\]|(?<=[A-Za-z_])[ #-]?(\d+)(?![\d.,/])")


def position(name: str) -> tuple[str | None, str | None]:
    """Return front or rear, and left or right, as far as a name says."""
    along = across = None
    name = apart(name)
    loose = _LOOSE.findall(name.lower())
    words = tokens(name)
    for token in words:
        meaning = _LONG.get(token)
        if meaning in ("front", "rear", "middle"):
            along = along or meaning
        elif meaning is not None:
            across = across or meaning
        elif token in _PAIRS:
            along, across = along or _PAIRS[token][0], across or _PAIRS[token][1]
    if along is not None and across is None and _FRENCH & {*words}:
        across = "left" if "g" in words else "right" if "d" in words else None
    for token in loose:
        if token in ("f", "b"):
            along = along or ("front" if token == "f" else "rear")
        elif token == "l":
            across = across or "left"
    if "r" in loose:
        if along is None and across is not None:
            along = "rear"
        elif across is None and along is not None:
            across = "right"
    return along, across


def row_of(name: str) -> tuple[int, str] | None:
    """Number of an axle and the side on it, which stand side by side: of ``A1L``, ``L1``, ``axle1_left`` and ``left_1`` 1 and left.

    None where a name says no such two, or front or rear as well.
    """
    words = tokens(name)
    sides = [
        {"l": "left", "r": "right"}.get(w) or (_LONG[w] if _LONG.get(w) in ("left", "right") else "") for w in words
    ]
    if any(_LONG.get(w) in ("front", "rear", "middle") or w in _PAIRS for w in words):
        return None
    both = range(len(words) - 1)
    found = [(int(words[i]), sides[i + 1]) for i in both if words[i].isdigit() and sides[i + 1]]
    found += [(int(words[i + 1]), sides[i]) for i in both if words[i + 1].isdigit() and sides[i]]
    return found[0] if found and found[0][0] < _MOST_ROWS else None


def axle_words(name: str) -> frozenset[str]:
    """Words that say nothing but that a number behind them is of an axle, in a name with that and a side; else empty."""
    return _AXLE if row_of(name) is not None else frozenset()


def axle_number(name: str) -> int | None:
    """Number of an axle in a name of its steering, the first behind the word that says so, else the first of all: of ``steer_A1/angle2`` 1."""
    words = tokens(name)
    begin = next((i for i, w in enumerate(words) if _STEER.search(w)), 0)
    return next((int(w) for w in (*words[begin:], *words) if w.isdigit()), None)


def rows_of(wheels: Iterable[str]) -> dict[tuple[int, str], str]:
    """Wheels by axle and side, where all of several are called by these; else empty."""
    rows = {row: wheel for wheel in wheels if (row := row_of(wheel)) is not None}
    return rows if len(rows) > 1 and len(rows) == len([*wheels]) else {}


def end_of(name: str) -> str | None:
    """Front or rear of the name of an axle: ``r`` alone is the rear, for an axle has no side."""
    along, across = position(name)
    return "rear" if along is None and across is None and "r" in _LOOSE.findall(name.lower()) else along


def is_place(word: str) -> bool:
    """Whether a lower-case word says nothing but a place: ``left``, ``vl``, ``ha``."""
    return word in _LONG or word in _PAIRS


def without_place(name: str) -> str:
    """The name without the places at its end: of ``wheel_rpm_FL`` and ``speed_kmh_front_left`` wheel_rpm and speed_kmh."""
    parts = re.split(r"([_ .-]+)", name)
    while len(parts) > 2 and (is_place(parts[-1].lower()) or parts[-1].lower() in ("l", "r")):
        parts = parts[:-2]
    return "".join(parts)


def is_steering(name: str) -> bool:
    """Whether a name speaks of steering, or of an angle of an axle."""
    if re.search(r"cast[eo]r", name.lower()):  # swivels by itself
        return False
    if _STEER.search(name.lower()) is not None:
        return True
    words = {*tokens(name)}
    if {"str", "strg"} & words and _OF_STEERING & words:
        return True
    return bool(_ANGLES & words) and position(name) in (("front", None), ("rear", None))


def is_drive(name: str) -> bool:
    """Whether a name speaks of a driven wheel."""
    return _DRIVE.search(name.lower()) is not None and not is_steering(name)


def speaks_of_no_wheel(name: str) -> bool:
    """Whether a name speaks of an arm, a caster or the like."""
    return _NO_DRIVE.search(name.lower()) is not None


def side_of(name: str) -> str | None:
    """Left or right of a name that says nothing of front and rear; None where it says more, or neither."""
    along, across = position(name)
    if along is None and across is None and "r" in _LOOSE.findall(apart(name).lower()):
        across = "right"
    return across if along is None else None


def wheel_of(name: str, machine: Machine) -> str | None:
    """Wheel that a name speaks of by its own name or by its place; None where it says neither."""
    words = tokens(name)
    for wheel in machine.wheels:
        if wheel.lower() in words and len(wheel) > 1:
            return wheel
    if rows := rows_of(machine.wheels):
        row = row_of(name)
        return None if row is None or speaks_of_no_wheel(name) else rows.get(row)
    sides = {side_of(w): w for w in machine.wheels}
    if len(machine.wheels) == 2 and set(sides) == {"left", "right"}:  # one wheel, or chain of wheels, on each side
        return None if speaks_of_no_wheel(name) else sides.get(side_of(_SIDE_AT_END.sub(r"_\1", name)))
    place = position(name)
    if None in place or re.search(r"cast[eo]r", name.lower()):
        return None
    return next((w for w in machine.wheels if position(w) == place), None)


def wheel_said(label: str, machine: Machine) -> str | None:
    """Wheel that the label of a source speaks of by words alone, not by a number: the joint in brackets, else the whole."""
    name = bare_name(label)[0]
    inner = re.search(r"\[([A-Za-z_][^\[\]]*)\]$", name)
    return wheel_of(inner[1] if inner else re.sub(r"\[\d+\]", "", name), machine)


def axle_of(name: str, machine: Machine) -> str | None:
    """Steering axle that a name speaks of."""
    wheel = wheel_of(name, machine)
    if wheel is not None and own_axle(wheel) in machine.axles:
        return own_axle(wheel)
    words = tokens(name)
    for axle in machine.axles:
        if axle.lower() in words:
            return axle
    if (rows := rows_of(machine.wheels)) and machine.geometry is not None and (number := axle_number(name)) is not None:
        of_it = {machine.geometry.wheels[w].axle for (n, _), w in rows.items() if n == number}
        return axle if len(of_it) == 1 and (axle := of_it.pop()) in machine.axles else None
    if end_of(name) is None and position(name)[1] is None and len(machine.axles) == 1 and is_steering(name):
        return machine.axles[0]
    return end if (end := end_of(name)) in machine.axles else None


def index_of(name: str) -> tuple[str, int] | None:
    """Return the name with its number replaced by ``#``, and that number; None where it has none."""
    found = list(_INDEX.finditer(name))
    if not found:
        return None
    bracket = [m for m in found if m.group(1)]
    last = bracket[-1] if bracket else found[-1]
    return name[: last.start()] + "#" + name[last.end() :], int(last.group(1) or last.group(2))


def first_indices(names: Iterable[str]) -> dict[str, int]:
    """Smallest number of each numbered family of names: 0 or 1 tells where it counts from."""
    first: dict[str, int] = {}
    for name in names:
        found = index_of(name)
        if found is not None:
            first[found[0]] = min(found[1], first.get(found[0], found[1]))
    return first
