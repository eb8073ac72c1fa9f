"""Frames: bytes to messages and back, by the layout.

A message is a dict with the field names of docs/wire.md; an enum is its name, or {name: content}; a digest is hexadecimal digits.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any, Callable, Tuple

from . import _layout as layout
from ._rules import RULES, Message, Refused

# Reads a value at a place; the value and the place after it.
Reader = Callable[[bytes, int], Tuple[Any, int]]
# Appends a value.
Writer = Callable[[bytearray, Any], None]

_F64 = struct.Struct("<d")


def read_varint(data: bytes, at: int, bits: int) -> tuple[int, int]:
    """An unsigned number of at most `bits` bits, and the place after it."""
    try:
        byte = data[at]
        at += 1
        if byte < 0x80:
            return byte, at
        value, shift = byte & 0x7F, 7
        while shift < bits:
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                if value >> bits:
                    break
                return value, at
            shift += 7
    except IndexError:
        raise Refused("the body ends too early") from None
    if value >> bits:
        raise Refused(f"a number has more than {bits} bits")
    raise Refused(f"a number of {bits} bits has more than {-(-bits // 7)} bytes")


def _write_varint(out: bytearray, value: int) -> None:
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)


def take(data: bytes, at: int, count: int) -> int:
    """The place after `count` bytes."""
    if count > len(data) - at:
        raise Refused("the body ends too early")
    return at + count


def read_count(data: bytes, at: int, least: int, most: int) -> tuple[int, int]:
    """The number of elements of a list."""
    count, at = read_varint(data, at, 64)
    if not least <= count <= most:
        raise Refused(f"a list has {count} elements, must have {least} to {most}")
    return count, at


def _basic(form: str) -> tuple[Reader, Writer]:
    if form in ("u8", "bool"):
        most = 255 if form == "u8" else 1

        def read(data: bytes, at: int) -> tuple[Any, int]:
            end = take(data, at, 1)
            value = data[at]
            if value > most:
                raise Refused(f"a bool is {value}")
            return (value if form == "u8" else value == 1), end

        def write(out: bytearray, value: Any) -> None:
            if not 0 <= value <= most:
                raise Refused(f"{value} is no {form}")
            out.append(int(value))

        return read, write
    if form == "f64":

        def read_f64(data: bytes, at: int) -> tuple[Any, int]:
            end = take(data, at, 8)
            return _F64.unpack_from(data, at)[0], end

        def write_f64(out: bytearray, value: Any) -> None:
            out += _F64.pack(value)

        return read_f64, write_f64
    bits = int(form[1:])
    if form[0] == "u":

        def read_unsigned(data: bytes, at: int) -> tuple[Any, int]:
            return read_varint(data, at, bits)

        def write_unsigned(out: bytearray, value: Any) -> None:
            if not 0 <= value < 1 << bits:
                raise Refused(f"{value} is no {form}")
            _write_varint(out, int(value))

        return read_unsigned, write_unsigned

    def read_signed(data: bytes, at: int) -> tuple[Any, int]:
        value, at = read_varint(data, at, bits)
        return (value >> 1) ^ -(value & 1), at

    def write_signed(out: bytearray, value: Any) -> None:
        if not -(1 << bits - 1) <= value < 1 << bits - 1:
            raise Refused(f"{value} is no {form}")
        _write_varint(out, int(value) << 1 if value >= 0 else (-int(value) << 1) - 1)

    return read_signed, write_signed


def _text(most: int) -> tuple[Reader, Writer]:
    def read(data: bytes, at: int) -> tuple[Any, int]:
        count, at = read_varint(data, at, 64)
        if count > most:
            raise Refused(f"a text has {count} bytes, at most {most} are allowed")
        end = take(data, at, count)
        try:
            return str(data[at:end], "utf-8"), end
        except UnicodeDecodeError:
            raise Refused("a text is not UTF-8") from None

    def write(out: bytearray, value: Any) -> None:
        encoded = value.encode("utf-8")
        if len(encoded) > most:
            raise Refused(f"{value!r} has {len(encoded)} bytes, at most {most} are allowed")
        _write_varint(out, len(encoded))
        out += encoded

    return read, write


def _digest(count: int) -> tuple[Reader, Writer]:
    def read(data: bytes, at: int) -> tuple[Any, int]:
        end = take(data, at, count)
        return bytes(data[at:end]).hex(), end

    def write(out: bytearray, value: Any) -> None:
        digest = bytes.fromhex(value)
        if len(digest) != count:
            raise Refused(f"{value!r} has not {count} bytes")
        out += digest

    return read, write


def _list(form: Any, least: int, most: int, counted: bool) -> tuple[Reader, Writer]:
    read_item, write_item = codec(form)

    def read(data: bytes, at: int) -> tuple[Any, int]:
        count = most
        if counted:
            count, at = read_count(data, at, least, most)
        if form == "u8":
            end = take(data, at, count)
            return list(data[at:end]), end
        if form == "f64":
            # At once: a reading is a few numbers, and a function for each costs more than they do.
            end = take(data, at, 8 * count)
            return list(struct.unpack_from(f"<{count}d", data, at)), end
        items = []
        for _ in range(count):
            item, at = read_item(data, at)
            items.append(item)
        return items, at

    def write(out: bytearray, value: Any) -> None:
        if not least <= len(value) <= most:
            raise Refused(f"a list has {len(value)} elements, must have {least} to {most}")
        if counted:
            _write_varint(out, len(value))
        for item in value:
            write_item(out, item)

    return read, write


def _option(form: Any) -> tuple[Reader, Writer]:
    read_item, write_item = codec(form)

    def read(data: bytes, at: int) -> tuple[Any, int]:
        try:
            present = data[at]
        except IndexError:
            raise Refused("the body ends too early") from None
        if present == 0:
            return None, at + 1
        if present > 1:
            raise Refused(f"an optional value begins with {present}, must be 0 or 1")
        return read_item(data, at + 1)

    def write(out: bytearray, value: Any) -> None:
        out.append(int(value is not None))
        if value is not None:
            write_item(out, value)

    return read, write


def _reals_after(first: tuple[str, Reader, Writer], names: list[str]) -> tuple[Reader, Writer]:
    """A struct of a field and numbers, which are read at once: each batch has one for each channel."""
    name, read_first, write_first = first
    reals = struct.Struct(f"<{len(names)}d")

    def read(data: bytes, at: int) -> tuple[Any, int]:
        value, at = read_first(data, at)
        end = take(data, at, reals.size)
        return {name: value, **dict(zip(names, reals.unpack_from(data, at)))}, end

    def write(out: bytearray, value: Any) -> None:
        write_first(out, value[name])
        out += reals.pack(*(value[other] for other in names))

    return read, write


def _struct(name: str) -> tuple[Reader, Writer]:
    fields = [(field, *codec(form)) for field, form in layout.STRUCTS[name]]
    if all(form == "f64" for _, form in layout.STRUCTS[name][1:]):
        return _reals_after(fields[0], [field for field, *_ in fields[1:]])

    def read(data: bytes, at: int) -> tuple[Any, int]:
        message = {}
        for field, read_field, _ in fields:
            message[field], at = read_field(data, at)
        return message, at

    def write(out: bytearray, value: Any) -> None:
        for field, _, write_field in fields:
            write_field(out, value[field])

    return read, write


def _enum(name: str) -> tuple[Reader, Writer]:
    variants = [(variant, None if form is None else codec(form)) for variant, form in layout.ENUMS[name]]
    numbers = {variant: number for number, (variant, _) in enumerate(variants)}

    def read(data: bytes, at: int) -> tuple[Any, int]:
        number, at = read_varint(data, at, 32)
        if number >= len(variants):
            raise Refused(f"{name.replace('_', ' ')} has no variant {number}")
        variant, content = variants[number]
        if content is None:
            return variant, at
        value, at = content[0](data, at)
        return {variant: value}, at

    def write(out: bytearray, value: Any) -> None:
        variant, content = (value, None) if isinstance(value, str) else next(iter(value.items()))
        if variant not in numbers:
            raise Refused(f"{name.replace('_', ' ')} has no variant {variant!r}, only {', '.join(numbers)}")
        number = numbers[variant]
        _write_varint(out, number)
        codec_of = variants[number][1]
        if codec_of is not None:
            codec_of[1](out, content)

    return read, write


_CODECS: dict[Any, tuple[Reader, Writer]] = {}


def codec(form: Any) -> tuple[Reader, Writer]:
    """Reader and writer of a form of the layout."""
    if form not in _CODECS:
        _CODECS[form] = _make(form)
    return _CODECS[form]


def _make(form: Any) -> tuple[Reader, Writer]:
    if isinstance(form, str):
        return _basic(form)
    what, *rest = form
    if what == "string":
        return _text(rest[0])
    if what == "digest":
        return _digest(rest[0])
    if what == "array":
        return _list(rest[0], rest[1], rest[1], counted=False)
    if what == "list":
        return _list(rest[0], rest[1], rest[2], counted=True)
    if what == "option":
        return _option(rest[0])
    name = rest[0]
    return _struct(name) if name in layout.STRUCTS else _enum(name)


def body_of(frame: bytes, kind: int) -> tuple[str, bytes]:
    """Type and bytes of the body of a sound frame on a key of `kind`; raises `Refused`."""
    if not layout.FRAME_BYTES_LEAST <= len(frame) <= layout.FRAME_BYTES:
        raise Refused(f"a frame has {len(frame)} bytes, must have {layout.FRAME_BYTES_LEAST} to {layout.FRAME_BYTES}")
    if frame[0] != kind:
        raise Refused(f"the frame is of kind {frame[0]}, its key promises {kind}")
    bodies = layout.KINDS[kind][1]
    version = frame[1]
    if not 1 <= version <= len(bodies):
        raise Refused(f"kind {kind} has version {version}, this package knows 1 to {len(bodies)}: update it")
    checksum = int.from_bytes(frame[-4:], "little")
    found = zlib.crc32(memoryview(frame)[:-4])
    if checksum != found:
        raise Refused(f"the checksum is {checksum:#010x}, the bytes give {found:#010x}")
    return bodies[version - 1], frame[2:-4]


def decode(frame: bytes, kind: int) -> Message:
    """The message in a frame of a key on which messages of `kind` are published, e.g. `isotherm.STATUS`.

    Raises `Refused`, whatever the bytes are.
    """
    name, body = body_of(frame, kind)
    message, end = codec(("named", name))[0](body, 0)
    if end != len(body):
        raise Refused(f"{len(body) - end} bytes are left over after the body")
    for rule in layout.KINDS[kind][2]:
        RULES[rule](message)
    return dict(message)


def encode(message: Message, kind: int, version: int | None = None) -> bytes:
    """The frame of a message, in the last version whose fields it has where none is given. Raises `Refused`."""
    _, bodies, rules = layout.KINDS[kind]
    if version is None:
        fits = (form for form in range(len(bodies), 0, -1) if all(name in message for name, _ in layout.STRUCTS[bodies[form - 1]]))
        version = next(fits, len(bodies))
    frame = bytearray([kind, version])
    codec(("named", bodies[version - 1]))[1](frame, message)
    for rule in rules:
        RULES[rule](message)
    frame += zlib.crc32(frame).to_bytes(4, "little")
    if len(frame) > layout.FRAME_BYTES:
        raise Refused(f"the frame has {len(frame)} bytes, at most {layout.FRAME_BYTES} are allowed")
    return bytes(frame)
