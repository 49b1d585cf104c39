"""The law that ran, as a controller, and the laws that are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from replay.control.loop import Replay
from replay.controllers.choice import CONTROLLER_NAMES, Controller
from replay.errors import ConfigError, NotJudged
from replay.machine.config import Machine

#: MFHCA exactly as printed: Ψ̂ that can only decay, |v| in the law.
PRINTED = "printed"
LAW_NAMES: tuple[str, ...] = ("mfhca", PRINTED, *CONTROLLER_NAMES[1:])


@dataclass(frozen=True)
class Law:
    """A law by its name in results, with what runs it.

    Attributes
    ----------
    name : str
        ``recorded``, or one of `LAW_NAMES`.
    controller : Controller
        Class and gains.
    psi0 : tuple[float, ...]
        Ψ̂(0) of each wheel; empty: 0.
    """

    name: str
    controller: Controller
    psi0: tuple[float, ...] = ()


def recorded_law(replay: Replay, machine: Machine, name: str) -> Law:
    """The law that gave the recorded commands.

    Raises
    ------
    NotJudged
        Where the log does not tell which one it was.
    """
    if replay.pi is not None:
        pi = replay.pi
        gains = {"kp": max(pi.kp, 0.0), "ki": max(pi.ki, 0.0), "ff": max(pi.feed_forward, 0.0)}
        return Law("recorded", Controller("pi", gains))
    law = replay.law
    if law is None or not replay.fits:
        raise NotJudged(
            f"{name}: no law is known to explain its valve commands, so that nothing can be said of another one; log "
            "wheel.*.u and the commanded speeds, or name the law that ran with --recorded"
        )
    if law.psi not in ("forced", PRINTED):
        raise NotJudged(
            f'{name}: Ψ̂ was read as {law.psi}, whose rule the log does not tell; give control.psi = "forced" with zeta, or '
            '"printed", in a machine file'
        )
    values = {"lambda": law.lambda_, "beta": law.beta, "xi": law.xi, "zeta": law.zeta if law.psi == "forced" else 0.0}
    own = [p for i, p in enumerate(replay.psi0) if i in machine.driven_columns] if law.psi == PRINTED else []
    psi0 = tuple(0.0 if p is None else p for p in own)
    return Law("recorded", Controller("mfhca", values, law.law, law.lead), psi0)


def asked_laws(names: Sequence[str], settings: Mapping[str, float], recorded: Law, machine: Machine) -> list[Law]:
    """Laws to predict.

    MFHCA keeps the parameters of the recorded law where that was MFHCA, and `settings` change them; the others have those of
    their class.

    Raises
    ------
    ConfigError
        As `check_laws`.
    """
    return [_asked(name, settings, recorded, machine) for name in check_laws(names, settings)]


def check_laws(names: Sequence[str], settings: Mapping[str, float]) -> list[str]:
    """Names of the laws that are asked for, each once.

    Raises
    ------
    ConfigError
        Where a name is not known, or parameters are given for several laws or for one that has none of that name.
    """
    wanted = list(dict.fromkeys(LAW_NAMES if "all" in names else names))
    for name in wanted:
        if name not in LAW_NAMES:
            raise ConfigError(f"--controller {name}: is not known; expected all or one of {', '.join(LAW_NAMES)}")
    if settings and len(wanted) > 1:
        raise ConfigError(f"--set: belongs to one law, {len(wanted)} are asked for; give one --controller")
    for name in wanted:
        Controller("mfhca" if name == PRINTED else name, settings)
    return wanted


def _asked(name: str, settings: Mapping[str, float], recorded: Law, machine: Machine) -> Law:
    control = machine.control
    if name == PRINTED:
        own = {"lambda": control.lambda_, "beta": control.beta, "xi": control.xi, "zeta": 0.0}
        return Law(name, Controller("mfhca", own | dict(settings), PRINTED))
    if name != "mfhca":
        return Law(name, Controller(name, settings))
    if recorded.controller.name == "mfhca":
        ran = recorded.controller
        return Law(name, Controller("mfhca", {**ran.own, **settings}, ran.reading, ran.lead), recorded.psi0)
    own = {"lambda": control.lambda_, "beta": control.beta, "xi": control.xi, "zeta": control.zeta}
    return Law(name, Controller("mfhca", own | dict(settings)))
