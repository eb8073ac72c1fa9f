"""Raw batches of docs/wire.md, as plainly and as fast as Python reads them.

Only what the bench sends: means, no lasing modes, no half-period counts.
"""

import struct
import zlib

GYRO, ACCEL, TEMPERATURE = 1, 2, 3
MEANS = 1


class Refused(ValueError):
    """A frame that cannot be read."""


def varint(data, at):
    """An unsigned number: seven bits per byte, lowest first; the number and the place behind it."""
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7


def zigzag(data, at):
    """A signed number."""
    value, at = varint(data, at)
    return (value >> 1) ^ -(value & 1), at


def body(frame, kind):
    """The body of a frame, after a look at kind, version and checksum."""
    if frame[0] != kind:
        raise Refused(f"kind {frame[0]}, not {kind}")
    if zlib.crc32(frame[:-4]) != int.from_bytes(frame[-4:], "little"):
        raise Refused("the checksum does not fit")
    return frame[2:-4]


def ticks(frame, kind):
    """First sequence number, end times (ns), durations (ns) and three readings for each tick of a gyro or accelerometer batch."""
    data = body(frame, kind)
    first, at = varint(data, 0)
    if kind == GYRO:
        _series, at = varint(data, at)
    count, at = varint(data, at)
    ends, durations, readings = [], [], []
    for _ in range(count):
        end, at = zigzag(data, at)
        duration, at = varint(data, at)
        if data[at] != MEANS or data[at + 1] != 3:
            raise Refused("not three means")
        ends.append(end)
        durations.append(duration)
        readings.append(struct.unpack_from("<3d", data, at + 2))
        at += 26
        if kind == GYRO:
            if data[at : at + 4] != b"\0\0\0\0":
                raise Refused("modes or half-period counts")
            at += 4
    return first, ends, durations, readings


def temperatures(frame):
    """Names of the channels, and time (ns) and readings of each tick of a temperature batch."""
    data = body(frame, TEMPERATURE)
    count, at = varint(data, 0)
    names = []
    for _ in range(count):
        length, at = varint(data, at)
        names.append(data[at : at + length].decode())
        at += length
    count, at = varint(data, at)
    rows = []
    for _ in range(count):
        time, at = zigzag(data, at)
        length, at = varint(data, at)
        rows.append((time, struct.unpack_from(f"<{length}d", data, at)))
        at += 8 * length
    return names, rows
