"""Channels that are called like the speeds of wheels, but for the place or the number, and that no signal is taken from."""

from __future__ import annotations

import re
from collections.abc import Mapping

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.signals.name_parts import axle_words, is_place, position, speaks_of_no_wheel
from replay.signals.name_words import tokens

_SPEED = re.compile(r"wheel\.[^.]+\.v")
_LOOSE = frozenset("flrbm")  # one letter of a place

#: Begins of the question in a machine file, of one channel and of several.
WHICH = ("which wheel is ", "which wheels are ")


def like_wheels(channels: Mapping[str, Channel], taken: Mapping[str, SignalSource]) -> tuple[str, ...]:
    """Names of channels that differ from a wheel's speed by the words of a place or by a number alone; empty where all are taken.

    A second channel of one place (``v_fl_2`` beside ``v_fl``, ``fl_1`` beside ``fl_2``) is a second measurement, and no wheel.

    Parameters
    ----------
    channels : Mapping[str, Channel]
        Of all files, by name.
    taken : Mapping[str, SignalSource]
        What each signal is taken from, by canonical name.
    """
    speeds = [origin.label for name, origin in taken.items() if _SPEED.fullmatch(name)]
    kinds = {kind for label in speeds if (kind := kind_of(label))}
    used = {origin.label for origin in taken.values()}
    places = {place for label in used if None not in (place := position(label))}
    unnumbered = {_unnumbered(label) for label in used}
    return tuple(
        name
        for name, channel in channels.items()
        if channel.name not in used
        and name not in used
        and not speaks_of_no_wheel(name)
        and kind_of(channel.name) in kinds
        and position(channel.name) not in places
        and not (
            _unnumbered(channel.name) in used or (channel.name in unnumbered and position(channel.name) != (None, None))
        )
    )


def kind_of(label: str) -> tuple[str, ...]:
    """Words of a name but for those of a place, and numbers."""
    axle = axle_words(label)
    return tuple(w for w in tokens(label) if not (is_place(w) or w.isdigit() or w in _LOOSE or w in axle))


def _unnumbered(label: str) -> str:
    return re.sub(r"[ _#-]?\d+(?![\d.,/])", "", label)
