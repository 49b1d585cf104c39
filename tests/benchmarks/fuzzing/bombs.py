"""Definitions and messages that are made to cost: deep, recursive, endless, doubled, or of absurd sizes; each well formed for its file."""

from __future__ import annotations

import json
import random
import struct

from google.protobuf import descriptor_pb2

from tests.benchmarks.fuzzing.damage import FAR

LINE = "=" * 80
KIND = descriptor_pb2.FieldDescriptorProto
SIZES = (
    "2147483647",
    "4294967296",
    "268435456",
    "268435457",
    "9" * 20,
    "9" * 4000,
    "-1",
    "0",
    "1000000",
    "0x10",
    "1e9",
    "",
    "<=",
    "<=0",
    "<=" + "9" * 30,
)


def text_definition(source: random.Random) -> bytes:
    """A definition in the ROS language."""
    depth, width = source.choice((2, 20, 31, 32, 33, 200, 3000)), source.choice((1, 1, 2, 9, 40))
    size, field = (
        source.choice(SIZES),
        source.choice(("float64", "string", "uint8", "wstring", "bool", "time", "char", "byte", "a/T1")),
    )
    chain = [
        "".join(f"a/T{k + 1}{source.choice(('', '[]', '[2]', '[<=3]', '[1000]'))} f{w}\n" for w in range(width))
        for k in range(min(depth, 4000 // width))
    ]
    chain.append(f"{field} x\n".replace("a/T1", "float32"))
    nested = f"\n{LINE}\nMSG: ".join(["", *(f"a/T{k}\n{text}" for k, text in enumerate(chain) if k)])
    whole = (
        chain[0] + nested,
        f"a/B x\n{LINE}\nMSG: a/B\na/B{source.choice(('', '[]', '[3]'))} y\n",
        f"a/C[] x\n{LINE}\nMSG: a/C\na/D[] y\n{LINE}\nMSG: a/D\na/C[] z\n",
        f"{field}[{size}] x\nfloat64 y\n",
        f"a/E[{size}] x\n{LINE}\nMSG: a/E\n{field}[{size}] t\n",
        f"a/E[{source.choice(SIZES)}][{size}] x\n",
        "".join(f"float64 f{k}\n" for k in range(source.choice((0, 1, 20_001, 60_000)))),
        f"float64 {'x' * source.choice((0, 1, 70_000))}\nfloat64 x\nfloat64 x\n",
        f'int32 X={size}\nstring S="{"a" * 9}\nint32[] d [1, 2,\nfloat64 data 1e999\n',
        f"float64 data # {'(' * 3000}\n\x00\xff\r\nfloat64 v\r\n\r\n{LINE}\r\n",
        f"float64 data\n{LINE}\nMSG: \n{LINE}\nMSG: a/B\n{LINE}\nMSG: a/B\nfloat64 other\n",
        f"string<={size} s\nwstring<={size}[<={size}] w\nfloat64 data\n",
        "",
        "\n" * 100_000,
        f"{field} " * 5000,
    )
    return source.choice(whole).encode("latin-1", "replace")


def idl_definition(source: random.Random) -> bytes:
    """A definition in IDL."""
    n, size = source.choice((2, 30, 400)), source.choice(SIZES)
    fields = (
        "sequence<" * n + "double" + ">" * n + " x;",
        f"double x[{size}];",
        "".join(f"double f{k};" for k in range(n * 4)),
        f"sequence<double, {size}> x; string<{size}> s;",
        "a::msg::I x;",
        "map<string, double> m; any z; fixed<3,2> q; wchar w; long double l;",
        f"@default(value={size}) double x;",
        "J x; K y;",
        "/* " + "*" * n + " double x;",
    )
    before = ("", f"typedef double J[{size}]; ", "enum K { A, B, C }; ", "union U switch (long) { case 1: double x; }; ", "struct I; ",
              "".join(f"typedef double T{k}; " for k in range(n)), f"const long N = {size}; ", "bitmask M { A, B }; ", "struct P { double p; }; ")  # fmt: skip
    return f"{'module a { ' * source.choice((1, 1, n))}module msg {{ {source.choice(before)}struct I{source.choice(('', ' : P', ' : I'))} {{ {source.choice(fields)} }}; }}; }};".encode()


def protobuf_definition(source: random.Random) -> bytes:
    """A set of descriptors whose root is ``a.P``."""
    files = descriptor_pb2.FileDescriptorSet()
    file = files.file.add(name="a.proto", package="a", syntax=source.choice(("proto3", "proto2", "", "proto9")))
    depth, width = source.choice((1, 3, 30, 31, 100, 1500)), source.choice((1, 2, 5))
    for k in range(depth):
        kind = file.message_type.add(name="P" if k == 0 else f"T{k}")
        for w in range(width):
            name = f".a.T{k + 1}" if k + 1 < depth else source.choice((".a.P", ".a.T1", ".a.None", "P", ""))
            label = source.choice((KIND.LABEL_OPTIONAL, KIND.LABEL_REPEATED))
            inner = source.random() < 0.9
            kind.field.add(name=f"f{w}", number=w + 1, type=KIND.TYPE_MESSAGE if inner else source.randrange(1, 19), type_name=name if inner else "", label=label)  # fmt: skip
        kind.field.add(name=source.choice(("v", "v", "f0", "", "x" * 5000)), number=source.choice((15, 1, 0, 2**29 - 1, 19000, -1)), type=KIND.TYPE_DOUBLE, label=KIND.LABEL_OPTIONAL)  # fmt: skip
    if source.random() < 0.3:
        file.message_type[0].field.extend(
            KIND(name=f"g{k}", number=20 + k, type=KIND.TYPE_FLOAT, label=KIND.LABEL_REPEATED) for k in range(source.choice((5, 20_001)))
        )  # fmt: skip
    if source.random() < 0.2:
        file.dependency.append(source.choice(("a.proto", "none.proto", "../x")))
    if source.random() < 0.2:
        files.file.add().CopyFrom(file)
    if source.random() < 0.2:
        kind = file.enum_type.add(name=source.choice(("E", "P")))
        kind.value.add(name="A", number=source.choice((0, -1, 2**31 - 1)))
    return bytes(files.SerializePartialToString(deterministic=True))


def cdr_message(source: random.Random) -> bytes:
    """Numbers at the bounds behind a head of any kind."""
    words = b"".join(
        source.choice(
            (
                struct.pack("<I", source.choice(FAR) % 2**32),
                struct.pack("<d", source.choice((0.0, 1.5, float("nan"), 1e308))),
            )
        )
        for _ in range(source.choice((0, 1, 2, 8, 60)))
    )
    return (
        bytes([0, source.choice((0, 1, 1, 1, 2, 3, 6, 7, 8, 9, 10, 11, 12, 255)), 0, source.choice((0, 0, 3))]) + words
    )


def _varint(value: int, extra: int = 0) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    for _ in range(extra):
        out[-1] |= 0x80
        out.append(0)
    return bytes(out)


def protobuf_message(source: random.Random) -> bytes:
    """Fields of any number and kind, nested deep, with lengths that agree with each other or not."""
    body = b"\x79" + struct.pack("<d", 1.5)
    for _ in range(source.choice((0, 1, 10, 99, 101, 3000))):
        length = len(body) + (0 if source.random() < 0.999 else source.choice((1, -1)))
        body = bytes([source.choice((0x0A, 0x0A, 0x12))]) + _varint(max(length, 0), source.choice((0, 0, 0, 1))) + body
    parts = [body]
    for _ in range(source.choice((0, 1, 5))):
        key = _varint(
            source.choice((1, 2, 5, 15, 2**29 - 1, 2**32)) << 3 | source.randrange(8), source.choice((0, 0, 4, 11))
        )
        parts.append(
            key
            + source.choice((b"", _varint(source.choice(FAR)), _varint(source.choice(FAR), 12), source.randbytes(8)))
        )
    source.shuffle(parts)
    return b"".join(parts)


def json_message(source: random.Random) -> bytes:
    """A document that is deep, wide, of new keys, or of values that parsers differ about."""
    n = source.choice((3, 300, 1100, 20_000))
    parts = (
        b"[" * n + b"]" * n,
        b'{"a":' * n + b"1" + b"}" * n,
        json.dumps({f"k{source.getrandbits(60)}": 1.0 for _ in range(min(n, 1100))}).encode(),
        json.dumps({"v": list(range(n))}).encode(),
        b'{"v": ' + b"9" * n + b"}",
        b'{"v": 1, "v": 2, "v": {"w": 3}, "": 4, ".": 5, "[0]": 6}',
        b'{"v": NaN, "w": -Infinity, "x": 1e400, "y": -0}',
        b'{"v": "\\ud800", "\\u0000": 1, "w": "\xff"}',
        b"\xef\xbb\xbf{}",
        b'{"v": 1}{"v": 2}',
        b'"' + b"x" * n + b'"',
        b"null",
        b"",
        b'{"v": 18446744073709551616, "w": -9223372036854775809, "stamp": {"sec": 99999999999999999999, "nsec": -1}}',
        b'{"stamp": {"sec": 1e300, "nsec": true}, "v": [1, "a", null, {"b": []}]}',
    )
    return source.choice(parts)
