"""Serialisations of messages: CDR in its kinds, ROS 1, and the numbers in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

from rosbags.interfaces import Nodetype

_DTYPES = {
    "bool": "?",
    "byte": "u1",
    "octet": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "int64": "i8",
    "uint64": "u8",
    "float64": "f8",
}

Field: TypeAlias = tuple[Any, Any]


class LayoutError(Exception):
    """A payload does not fit its definition; the text says where, `steps` after how many parts of it."""

    steps = 0


@dataclass(frozen=True)
class Dialect:
    """A serialisation.

    Attributes
    ----------
    head : bytes
        First bytes of every payload; none in ROS 1.
    order : str
        Byte order as NumPy writes it.
    align : int
        Largest alignment, counted from behind the four bytes of the encapsulation; 0 where nothing is aligned.
    boxed : bool
        Whether collections of strings and messages start with their size in bytes (XCDR2).
    slack : int
        Padding that may follow the last field [bytes].
    """

    head: bytes
    order: str
    align: int
    boxed: bool
    slack: int

    @property
    def base(self) -> int:
        """Where the first field stands."""
        return 4 if self.head else 0


ROS1 = Dialect(b"", "<", 0, False, 0)
# encapsulations of plain CDR (XCDR1) and plain CDR2 (XCDR2); what their types' definitions do not tell is not here
_CDR = {
    b"\0\0": Dialect(b"\0\0", ">", 8, False, 3),
    b"\0\1": Dialect(b"\0\1", "<", 8, False, 3),
    b"\0\6": Dialect(b"\0\6", ">", 4, True, 3),
    b"\0\7": Dialect(b"\0\7", "<", 4, True, 3),
}


def dialect_of(payload: bytes, ros1: bool) -> Dialect:
    """Tell a payload's serialisation.

    Raises
    ------
    LayoutError
        Where it is none that can be decoded.
    """
    if ros1:
        return ROS1
    if len(payload) < 4:
        raise LayoutError(f"a payload of {len(payload)} bytes has no encapsulation header")
    found = _CDR.get(payload[:2])
    if found is None:
        raise LayoutError(
            f"encapsulation {payload[:2].hex()} is not plain CDR (0000, 0001) or plain CDR2 (0006, 0007); record with "
            "final types, as ROS 2 does"
        )
    return found


def is_number(kind: Field) -> bool:
    """Whether a field is one number."""
    return bool(kind[0] == Nodetype.BASE and kind[1][0] != "string")


def width_of(dtype: str) -> int:
    """Bytes that a number type takes."""
    return 1 if dtype == "?" else int(dtype[1])


def type_of(name: str) -> str:
    """Return the number type of a primitive; raises `LayoutError` for those that are none."""
    if name not in _DTYPES:
        raise LayoutError(f"fields of type {name} are not supported")
    return _DTYPES[name]
