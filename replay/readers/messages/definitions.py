"""Message definitions: from the log's own text, or by name from the known ROS types."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from replay.readers.messages.idl_cost import MAX_MILLISECONDS, milliseconds

Fields: TypeAlias = tuple[tuple[str, Any], ...]

MAX_DEFINITION = 1 << 20
MAX_LINES = 5_000  # some 0.7 s of the parser; the longest of the ROS distributions have some hundreds
MAX_DEPTH = 32
MAX_ARRAY = 1 << 28
TIME = "builtin_interfaces/msg/Time"
DURATION = "builtin_interfaces/msg/Duration"
HEADER = "std_msgs/msg/Header"

# Interfaces of robot controllers that the ROS distributions keep outside their common packages.
_EXTRA = {
    "ackermann_msgs/msg/AckermannDrive": (
        "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\nfloat32 acceleration\nfloat32 jerk"
    ),
    "ackermann_msgs/msg/AckermannDriveStamped": "std_msgs/Header header\nAckermannDrive drive",
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values"
    ),
}
_STORES = (
    Stores.LATEST,
    Stores.ROS2_LYRICAL,
    Stores.ROS2_JAZZY,
    Stores.ROS2_HUMBLE,
    Stores.ROS2_IRON,
    Stores.ROS2_FOXY,
    Stores.ROS2_DASHING,
)


_IDL_FILE = re.compile(r"^=+[ \t\r]*\nIDL:[^\n]*\n", re.MULTILINE)
_DIRECTIVE = re.compile(r"^[ \t]*#[^\n]*$", re.MULTILINE)
_EMPTY = re.compile(r"\n(?:[ \t\r]*+(?:#[^\n]*+)?\n)++")


class DefinitionError(Exception):
    """A message type has no usable definition; the text says why."""


@dataclass(frozen=True)
class MessageType:
    """One message type with everything that its payload holds.

    Attributes
    ----------
    name : str
        Full name (``sensor_msgs/msg/JointState``).
    fields : dict[str, tuple]
        Field name and descriptor of every type reachable from `name`.
    stamp : str or None
        Path of the header stamp (``header.stamp``), where the message has one.
    ros1 : bool
        Whether payloads are in ROS 1 serialisation, else CDR.
    note : str
        Where the definition came from, if not from the log.
    """

    name: str
    fields: dict[str, Fields]
    stamp: str | None
    ros1: bool
    note: str = ""

    def inside(self, name: str) -> set[str]:
        """Names of all types within a type, itself among them, each met once however often it is named."""
        met, waiting = {name}, [name]
        while waiting:
            for _, (kind, value) in self.fields[waiting.pop()]:
                sub = value[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (kind, value)
                if sub[0] == Nodetype.NAME and sub[1] not in met:
                    met.add(sub[1])
                    waiting.append(sub[1])
        return met


def full_name(name: str) -> str:
    """Return ``package/msg/Type`` for ``package/Type``."""
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


@lru_cache(maxsize=64)
def resolve(name: str, encoding: str, text: str, ros1: bool) -> MessageType:
    """Build the message type from its definition, or by its name where the log holds none.

    Parameters
    ----------
    name : str
        Message type as recorded.
    encoding : str
        ``ros2msg``, ``ros1msg``, ``ros2idl``, ``omgidl`` or empty.
    text : str
        Definition as recorded; empty where the log holds none.
    ros1 : bool
        Whether payloads are in ROS 1 serialisation.

    Raises
    ------
    DefinitionError
        Where no definition is found or it cannot be understood.
    """
    root = full_name(name)
    if text.strip() or encoding == "ros1msg":
        fields, note = _parse(root, encoding, text), ""
    else:
        fields, note = _by_name(root, ros1), "definition not in the log, taken by name"
    reached: dict[str, Fields] = {}
    _reach(root, fields, reached, (), ros1)
    return MessageType(root, reached, _stamp_path(root, reached), ros1, note)


def _parse(root: str, encoding: str, text: str) -> dict[str, Fields]:
    if len(text) > MAX_DEFINITION:
        raise DefinitionError(f"its definition has {len(text)} characters; at most {MAX_DEFINITION} are read")
    idl = encoding in ("ros2idl", "omgidl")
    if not idl:
        text = _bounded(text)
    if idl and milliseconds(text) > MAX_MILLISECONDS:
        raise DefinitionError(
            "its definition holds too many expressions, or brackets within brackets, to be parsed in time"
        )
    try:
        parsed = _parse_idl(text) if idl else get_types_from_msg(text, root)
    except Exception as error:  # the parser raises many kinds on hostile text, RecursionError among them
        raise DefinitionError(f"its definition cannot be parsed ({type(error).__name__})") from error
    return {name: tuple(parts[1]) for name, parts in parsed.items()}


@lru_cache(maxsize=256)
def checksum(text: str, root: str) -> str:
    """MD5 sum of a ROS 1 definition, as publishers state it; empty where it is none that can be read in time."""
    try:
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(_bounded(text), root))
        digest: str = store.generate_msgdef(root, ros_version=1)[1]
    except Exception:  # a damaged definition fails in any way
        return ""
    return digest


def _bounded(text: str) -> str:
    """A definition without empty lines and comments, for which the parser takes as long as for fields.

    Raises
    ------
    DefinitionError
        Where it has more lines than are read.
    """
    if len(text) > MAX_DEFINITION:
        raise DefinitionError(f"its definition has {len(text)} characters; at most {MAX_DEFINITION} are read")
    text = _EMPTY.sub("\n", f"\n{text}")
    if text.count("\n") > MAX_LINES:
        raise DefinitionError(f"its definition has {text.count(chr(10))} lines; at most {MAX_LINES} are read")
    return text


def _parse_idl(text: str) -> dict[str, Any]:
    """Parse IDL: one file, or several that lines ``IDL: name`` divide; they hold what they include."""
    parsed: dict[str, Any] = {}
    for file in _IDL_FILE.split(text):
        if file.strip():
            parsed.update(get_types_from_idl(_DIRECTIVE.sub("", file)))
    return parsed


@lru_cache(maxsize=1024)
def _by_name(root: str, ros1: bool) -> dict[str, Fields]:
    if not ros1 and root in _EXTRA:
        return {name: fields for name in _EXTRA for fields in [_parse(name, "ros2msg", _EXTRA[name])[name]]}
    for store in (Stores.ROS1_NOETIC,) if ros1 else _STORES:
        known = get_typestore(store).fielddefs
        if root in known:
            return {name: tuple(parts[1]) for name, parts in known.items()}
    raise DefinitionError("the log holds no definition of this type and it is not a known ROS type")


def _reach(root: str, known: dict[str, Fields], out: dict[str, Fields], above: tuple[str, ...], ros1: bool) -> None:
    """Collect the types reachable from `root`; refuse missing, recursive and too deep ones."""
    if root in above or len(above) > MAX_DEPTH:
        raise DefinitionError(f"its definition nests {root} without end")
    if root in out:
        return
    if root not in known:
        if root in (TIME, DURATION):
            known = {**known, root: _by_name(root, False)[root]}
        elif above:
            try:
                known = {**_by_name(root, ros1), **known}
            except DefinitionError:
                raise DefinitionError(f"its definition lacks the type {root}") from None
        else:
            raise DefinitionError(f"its definition does not define {root}")
    for label, (kind, value) in known[root]:
        if kind == Nodetype.ARRAY and value[1] > MAX_ARRAY:
            raise DefinitionError(
                f"its definition gives {label} {str(value[1])[:20]} elements; at most {MAX_ARRAY} are read"
            )
        sub = value[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (kind, value)
        if sub[0] == Nodetype.NAME:
            _reach(sub[1], known, out, (*above, root), ros1)
        elif sub[0] != Nodetype.BASE:
            raise DefinitionError("its definition nests sequences directly")
    out[root] = known[root]


def _stamp_path(root: str, fields: dict[str, Fields]) -> str | None:
    top = {name: value for name, (kind, value) in fields[root] if kind == Nodetype.NAME}
    for name, type_name in top.items():
        if type_name == HEADER:
            return f"{name}.stamp"
    for name in ("stamp", "timestamp"):
        if top.get(name) == TIME:
            return name
    return None
