"""Words of a recorded name, those of programs in other languages in English: ``Lenkwinkel_soll``, ``consigne_angle``: steer angle ref."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache

# Type letters that PLC programs put before a name (fVelocity, lrSpeed, fbWheel).
_PREFIX = re.compile(r"(?<![A-Za-z])(?:lr|fb|st|ar|[abefgimnprstuwx])(?=[A-Z][a-z])")
# Words of a place that are written as one.
_JOINED = re.compile(
    r"(?i)(front|rear|back|middle|mid|vorne|vorn|hinten|left|right|links|rechts|voor|achter|etu|taka)"
    r"(?=left|right|links|rechts|front|rear|back|wheel|rad|voor|achter|wiel|vasen|oikea|pyora|pyoera)"
)
# A place in capitals and what is of it, written as one: Rspeed, LSpeed, FLcmd.
_OF_A_PLACE = (
    "speed", "spd", "vel", "velocity", "velo", "rpm", "enc", "encoder", "tick", "count", "wheel", "motor", "pos", "position", "torque",
    "trq", "current", "cmd", "command", "ref", "target", "actual", "act", "set", "meas", "steer", "angle", "valve", "pwm", "duty", "volt",
)  # fmt: skip
_CAPITAL_PLACE = re.compile(
    r"(?<![A-Za-z])([LR]|[FRBVHM][LR]|[LR][FRBM])"
    rf"(?=(?:{'|'.join(f'[{w[0].upper()}{w[0]}]{w[1:]}' for w in _OF_A_PLACE)})s?(?![a-z]))"
)
_UMLAUTS = str.maketrans(
    {
        "ä": "ae",
        "ö": "oe",
        "ü": "ue",
        "ß": "ss",
        "Ä": "Ae",
        "Ö": "Oe",
        "Ü": "Ue",
        "ø": "oe",
        "Ø": "Oe",
        "ł": "l",
        "Ł": "L",
    }
)
# German words that are written together: Lenkwinkel, Istdrehzahl, Vorderachse.
_PARTS = (
    "geschwindigkeit", "geschw", "drehzahl", "drehmoment", "drehrate", "gierrate", "gier", "winkel", "lenkung", "lenk",
    "ventil", "schieber", "stellung", "stell", "groesse", "ansteuerung", "strom", "spannung", "moment", "druck", "motor",
    "fahr", "antrieb", "achse", "achs", "vorder", "hinter", "vorne", "vorn", "hinten", "links", "rechts", "rad", "soll", "ist",
    "mess", "wert", "werte", "signal", "befehl", "vorgabe", "rate", "position", "dreh", "kolben", "weg", "hub", "oeffnung", "oeffnungsgrad",
)  # fmt: skip
_TOGETHER = re.compile(rf"(?:{'|'.join(_PARTS)})+")
_PART = re.compile("|".join(sorted(_PARTS, key=len, reverse=True)))
# A letter of a quantity and what is asked or measured of it, written as one: vset, nsoll, phiist.
_LETTER = re.compile(r"(v|n|w|u|phi|omega)(set|soll|ist|ref|cmd|act|des|target|meas)")
_MEANINGS = {
    "ref": "soll sollwert vorgabe vorg consigne cons ohje gewenst",
    "cmd": "ansteuerung commande",
    "act": "ist istwert mess messwert gemessen rueckmeldung mesure mesuree mes reel reelle",
    "speed": "geschwindigkeit geschw vitesse vit spd speeds velocities velocidad velocidade velocita snelheid hastighet hastighed nopeus predkosc",
    "rpm": "drehzahl regime toerental varvtal",
    "angle": "winkel ang",
    "steer": "lenk lenkung braquage strg sterzo",
    "valve": "ventil vanne distributeur vlv",
    "spool": "schieber tiroir",
    "torque": "drehmoment couple trq",
    "current": "strom courant curr",
    "voltage": "spannung tension",
    "press": "druck pression",
    "wheel": "whl roue rueda ruota roda wiel hjul pyora pyoera kolo",
    "drive": "antrieb drv",
    "motor": "moteur motore",
    "axle": "achse achs essieu",
    "yaw_rate": "gierrate drehrate lacet gier yawrate",
    "joystick": "fahrhebel manche",
}
_ENGLISH = {word: meaning for meaning, words in _MEANINGS.items() for word in words.split()}
# Words that say nothing more behind others: Gierrate, Ventil Y VR.
_DROPPED = {"yaw_rate": ("rate", "geschwindigkeit", "vitesse", "vit"), "valve": ("y", "u")}
_OF_A_VALVE = {
    "kolben": "spool",
    "piston": "spool",
    "weg": "pos",
    "hub": "pos",
    "stroke": "pos",
    "travel": "pos",
    "course": "pos",
}
_FILLERS = frozenset(
    ("wert", "werte", "value", "val", "values", "percent", "pct", "prozent", "pourcent",
     *("mps", "kmh", "kph", "radps", "rads", "degps", "degs", "dps"))  # units that are no other word
)  # fmt: skip
_SET = ("groesse", "wert", "signal", "befehl")  # Stellgröße, Stellwert: what a valve is told
_OPENING = frozenset(
    ("opening", "oeffnung", "oeffnungsgrad", "ouverture", "apertura")
)  # of a valve: what every valve's channel is
#: Words that ask for something: setpoints and commands, in English.
ASKING = frozenset(
    ("ref", "reference", "cmd", "command", "commanded", "set", "setpoint", "des", "desired", "target", "demand", "soll",
     *("demanded", "requested", "references", "refs", "cmds", "commands", "setpoints", "targets"))
)  # fmt: skip
MEASURED = frozenset(("act", "actual", "meas", "measured", "fb", "feedback", "ist"))


def folded(text: str) -> str:
    """The text without umlauts and accents: ``Stellgröße``: Stellgroesse."""
    plain = unicodedata.normalize("NFKD", unicodedata.normalize("NFC", text).translate(_UMLAUTS))
    return "".join(c for c in plain if not unicodedata.combining(c))


def apart(name: str) -> str:
    """The name with a place in capitals parted from what is of it: ``Rspeed``: R_speed."""
    return _CAPITAL_PLACE.sub(r"\1_", name)


def tokens(name: str) -> list[str]:
    """Lower-case words of a name, split at other characters, at digits, before capitals and within German compounds."""
    return [*_tokens(name)]


@lru_cache(4096)
def _tokens(name: str) -> tuple[str, ...]:
    parted = _JOINED.sub(r"\1_", _PREFIX.sub("", apart(folded(name))))
    found = [t.lower() for t in re.findall(r"[A-Z]{1,}(?![a-z])|[A-Z]?[a-z]+|\d+", parted)]
    return tuple(part for word in found for part in _parted(word))


def _parted(word: str) -> Sequence[str]:
    """A lower-case word, or those that are written together in it."""
    if _TOGETHER.fullmatch(word):
        found: list[str] = _PART.findall(word)
        return found
    joined = _LETTER.fullmatch(word)
    return (word,) if joined is None else joined.groups()


def english(words: Sequence[str]) -> list[str]:
    """Words as the patterns of the signal table know them.

    ``n`` and ``v`` beside a setpoint or a measurement are a rotational speed and a speed, ``Stellgröße`` and ``Stellwert`` are a valve's command.

    Parameters
    ----------
    words : Sequence[str]
        Of `tokens`.
    """
    out: list[str] = []
    for word in words:
        if word in _SET and out[-1:] == ["stell"]:
            out[-1:] = ["cmd"] if "valve" in out else ["valve", "cmd"]
        elif word == "stellung" and out[-1:] == ["valve"]:
            out.append("pos")
        elif word in _FILLERS or (word in _DROPPED.get(out[-1], ()) if out else False):
            continue
        else:
            out.append("valve" if word.endswith("ventil") else _ENGLISH.get(word, word))  # Proportionalventil
    if "valve" in out:  # Kolbenweg of a valve: the way of its spool
        out = [_OF_A_VALVE.get(word, word) for word in out if word not in _OPENING]
    roles = ASKING | MEASURED
    for i, word in enumerate(out):
        if word in ("n", "v") and {*out[max(i - 1, 0) : i], *out[i + 1 : i + 2]} & roles:
            out[i] = "rpm" if word == "n" else "speed"
    return out


def role(words: Sequence[str]) -> str:
    """``ref`` where words ask, ``act`` where they measure, ``both`` where they do both, empty where they say neither."""
    asks, measures = bool(ASKING & {*words}), bool(MEASURED & {*words})
    return "both" if asks and measures else "ref" if asks else "act" if measures else ""
