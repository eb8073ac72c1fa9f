"""The wire messages of docs/wire.md, decoded and encoded in plain Python.

It rests on that page alone: the tables below have the order, the types and the limits of the page's tables.
A message is a dict with the page's field names; a `readings` is {"Counts": [...]} or {"Means": [...]}; an enum without
content is the name that the page gives it in quotes, a digest is hexadecimal digits.
"""

import math
import struct
import zlib

MAX_FRAME = 1 << 20
MAX_TICKS = 4096


class Refused(ValueError):
    """A frame that cannot be read; nothing of it is to be used."""


class Cursor:
    """A place in the bytes of a body."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def take(self, count):
        """The next `count` bytes."""
        part = self.data[self.at : self.at + count]
        if len(part) < count:
            raise Refused("the body ends too early")
        self.at += count
        return part


# The basic types. Each reads itself from a cursor and appends itself to a bytearray.


class Uint:
    """u16, u32, u64: seven bits per byte, lowest first; the top bit says that more follow."""

    def __init__(self, bits):
        self.bits = bits

    def read(self, cursor):
        value, shift = 0, 0
        while True:
            byte = cursor.take(1)[0]
            value |= (byte & 0x7F) << shift
            shift += 7
            if value >> self.bits:
                raise Refused(f"a number has more than {self.bits} bits")
            if byte < 0x80:
                return value
            if shift >= self.bits:
                raise Refused("a number is too long")

    def write(self, out, value):
        if not 0 <= value < 1 << self.bits:
            raise ValueError(f"{value} is no u{self.bits}")
        while value >= 0x80:
            out.append(value & 0x7F | 0x80)
            value >>= 7
        out.append(value)


class Sint:
    """i32, i64: zigzag (0, -1, 1, -2, ... become 0, 1, 2, 3, ...), then as an unsigned number."""

    def __init__(self, bits):
        self.unsigned = Uint(bits)

    def read(self, cursor):
        value = self.unsigned.read(cursor)
        return value >> 1 if value & 1 == 0 else -(value >> 1) - 1

    def write(self, out, value):
        self.unsigned.write(out, value << 1 if value >= 0 else (-value << 1) - 1)


class Byte:
    """u8: one byte as it is."""

    def read(self, cursor):
        return cursor.take(1)[0]

    def write(self, out, value):
        out.append(value)


class Bool:
    """One byte, 0 or 1."""

    def read(self, cursor):
        byte = cursor.take(1)[0]
        if byte > 1:
            raise Refused(f"a bool is {byte}")
        return byte == 1

    def write(self, out, value):
        out.append(int(value))


class F64:
    """IEEE 754 binary64, eight bytes, little-endian."""

    def read(self, cursor):
        return struct.unpack("<d", cursor.take(8))[0]

    def write(self, out, value):
        out += struct.pack("<d", value)


class Text:
    """Number of bytes, then so many bytes of UTF-8."""

    def __init__(self, most=MAX_FRAME):
        self.most = most

    def read(self, cursor):
        count = U64.read(cursor)
        if count > self.most:
            raise Refused(f"a text has {count} bytes, at most {self.most} are allowed")
        try:
            return cursor.take(count).decode("utf-8")
        except UnicodeDecodeError as error:
            raise Refused("a text is not UTF-8") from error

    def write(self, out, value):
        data = value.encode("utf-8")
        U64.write(out, len(data))
        out += data


class Seq:
    """Number of elements, then the elements."""

    def __init__(self, item, most):
        self.item = item
        self.most = most

    def read(self, cursor):
        count = U64.read(cursor)
        if count > self.most:
            raise Refused(f"a sequence has {count} elements, at most {self.most} are allowed")
        return [self.item.read(cursor) for _ in range(count)]

    def write(self, out, value):
        U64.write(out, len(value))
        for item in value:
            self.item.write(out, item)


class Array:
    """A fixed number of elements, which is not written."""

    def __init__(self, item, count):
        self.item = item
        self.count = count

    def read(self, cursor):
        return [self.item.read(cursor) for _ in range(self.count)]

    def write(self, out, value):
        for item in value:
            self.item.write(out, item)


class Digest:
    """A fixed number of bytes, here as hexadecimal digits."""

    def __init__(self, count):
        self.count = count

    def read(self, cursor):
        return cursor.take(self.count).hex()

    def write(self, out, value):
        data = bytes.fromhex(value)
        if len(data) != self.count:
            raise ValueError(f"{value} has not {self.count} bytes")
        out += data


class Option:
    """0 for none (None here); 1, then the value."""

    def __init__(self, item):
        self.item = item

    def read(self, cursor):
        tag = cursor.take(1)[0]
        if tag > 1:
            raise Refused(f"an option begins with {tag}")
        return self.item.read(cursor) if tag else None

    def write(self, out, value):
        out.append(int(value is not None))
        if value is not None:
            self.item.write(out, value)


class Enum:
    """The variant's number (u32), then the variant's content, where it has any."""

    def __init__(self, *names, **variants):
        self.variants = [(name, None) for name in names] + list(variants.items())

    def read(self, cursor):
        number = U32.read(cursor)
        if number >= len(self.variants):
            raise Refused(f"there is no variant {number}")
        name, content = self.variants[number]
        return name if content is None else {name: content.read(cursor)}

    def write(self, out, value):
        name, content = (value, None) if isinstance(value, str) else next(iter(value.items()))
        number = [name for name, _ in self.variants].index(name)
        U32.write(out, number)
        if content is not None:
            self.variants[number][1].write(out, content)


class Struct:
    """The fields one after the other, nothing between them."""

    def __init__(self, **fields):
        self.fields = fields

    def read(self, cursor):
        return {name: kind.read(cursor) for name, kind in self.fields.items()}

    def write(self, out, value):
        for name, kind in self.fields.items():
            kind.write(out, value[name])


U16, U32, U64, I32, I64 = Uint(16), Uint(32), Uint(64), Sint(32), Sint(64)

# The messages.

CHANNEL_NAME = Text(24)
MODE = Enum(Plus=None, Minus=None)
READINGS = Enum(Counts=Seq(I32, 8), Means=Seq(F64(), 8))
REVISION = Struct(counter=U64, digest=Digest(8))

GYRO_BATCH = Struct(
    first_sequence=U64,
    series=U64,
    ticks=Seq(
        Struct(
            end_time_ns=I64,
            duration_ns=U64,
            readings=READINGS,
            mode=Option(MODE),
            switch_command=Bool(),
            meander=Option(MODE),
            half_periods=Seq(Struct(positive=I32, negative=I32), 8),
        ),
        MAX_TICKS,
    ),
)

ACCEL_BATCH = Struct(
    first_sequence=U64,
    ticks=Seq(Struct(end_time_ns=I64, duration_ns=U64, readings=READINGS), MAX_TICKS),
)

TEMPERATURE_BATCH = Struct(
    channels=Seq(CHANNEL_NAME, 16),
    ticks=Seq(Struct(time_ns=I64, raw=Seq(F64(), 16)), MAX_TICKS),
)

CORRECTED_BATCH = Struct(
    unit=Text(),
    revision=REVISION,
    temperatures=Seq(Struct(channel=CHANNEL_NAME, temperature_deg_c=F64(), rate_deg_c_per_s=F64()), 16),
    ticks=Seq(
        Struct(
            sequence=U64,
            end_time_ns=I64,
            duration_ns=U64,
            ticks=U16,
            missed=U64,
            delta_angle_rad=Array(F64(), 3),
            delta_velocity_m_per_s=Array(F64(), 3),
            mode=Option(MODE),
            flags=U16,
            gyro_flags=Seq(Byte(), 8),
            accel_flags=Seq(Byte(), 8),
            gyro_parity_rad_per_s=Seq(F64(), 5),
            accel_parity_m_per_s2=Seq(F64(), 5),
        ),
        MAX_TICKS,
    ),
)

HEALTH_BATCH = Struct(
    ticks=Seq(Struct(time_ns=I64, readings=Seq(Struct(name=CHANNEL_NAME, value=F64()), 64)), MAX_TICKS),
)

REFERENCE_BODY = Struct(
    start_ns=I64,
    end_ns=I64,
    angular_rate_rad_per_s=Array(F64(), 3),
    sigma_rad_per_s=F64(),
)

COUNTER = Struct(name=Text(), value=U64)

STATUS_1 = Struct(
    unit=Text(),
    service_version=Text(),
    state=Enum(Uncalibrated=None, Held=None, Running=None),
    revision=REVISION,
    last_end_time_ns=Option(I64),
    last_sequence=Option(U64),
    channels=Seq(
        Struct(
            channel=CHANNEL_NAME,
            temperature_deg_c=Option(F64()),
            rate_deg_c_per_s=Option(F64()),
            stale=Bool(),
            warming_up=Bool(),
        ),
        256,
    ),
    counters=Seq(COUNTER, 256),
    last_fault=Option(Text()),
    added_latency_p50_ns=U64,
    added_latency_p99_ns=U64,
)

STATE = Enum(
    "standby",
    "self-test",
    "pre-launch calibration",
    "running with mode reversal",
    "running without mode reversal",
)
OUTPUT = Enum("calibrated", "pass-through", "held")
FAULT = Struct(kind=Text(), count=U64, first=Text(), last_unix_ms=I64)
PRE_LAUNCH_MODES = Seq(
    Struct(mode=Option(MODE), ticks=U64, time_s=F64(), mean_temperature_deg_c=Option(F64())),
    3,
)
CONSTANTS = Struct(
    gyro=Text(),
    static_bias_change_rad_per_s=F64(),
    static_bias_sigma_rad_per_s=F64(),
    magnetic_bias_change_rad_per_s=Option(F64()),
    magnetic_bias_sigma_rad_per_s=Option(F64()),
    earth_rate_rad_per_s=F64(),
    modes=PRE_LAUNCH_MODES,
)

STATUS_2 = Struct(
    unit=Text(),
    instance=Text(),
    version=Text(),
    state=STATE,
    output=OUTPUT,
    calibration=Option(
        Struct(
            revision=REVISION,
            digest=Option(Digest(32)),
            created_unix_s=Option(I64),
            age_s=Option(I64),
            source=Text(),
            overlay=Option(Digest(32)),
        )
    ),
    pending=Option(
        Struct(
            revision=REVISION,
            digest=Option(Digest(32)),
            source=Text(),
            schedule=Enum("next-tick", **{"sequence": U64, "time-ns": I64}),
            slew_s=F64(),
        )
    ),
    swaps=Struct(accepted=U64, refused=U64, last_refusal=Option(Text())),
    last_tick=Option(Struct(end_time_ns=I64, sequence=U64, series=U64)),
    channels=Seq(
        Struct(
            name=CHANNEL_NAME,
            temperature_deg_c=Option(F64()),
            rate_deg_c_per_s=Option(F64()),
            stale=Bool(),
            warming_up=Bool(),
            calibrated_range_deg_c=Option(Array(F64(), 2)),
            place=Option(Enum("below", "inside", "above")),
        ),
        256,
    ),
    sensors=Seq(
        Struct(
            name=Text(),
            kind=Enum("gyro", "accel"),
            flags=Byte(),
            ticks=U64,
            invalid=U64,
            overrange=U64,
            not_finite=U64,
            clamped=U64,
            stale=U64,
            excluded=U64,
        ),
        16,
    ),
    input_rates=Struct(
        gyro_ticks_per_s=F64(),
        accel_ticks_per_s=F64(),
        temperature_readings_per_s=F64(),
        messages_per_s=F64(),
    ),
    applied=Option(Struct(angular_rate_rad_per_s=Array(F64(), 3), specific_force_m_per_s2=Array(F64(), 3))),
    drift=Seq(
        Struct(
            gyro=Text(),
            rate_rad_per_s=F64(),
            sigma_rad_per_s=F64(),
            trend_rad_per_s2=F64(),
            updates=U64,
            refused=U64,
            mean_nis=Option(F64()),
            last_update_ns=Option(I64),
            subtracted=Bool(),
        ),
        16,
    ),
    rest=Option(Enum("learning", "still", moved=Text())),
    self_test=Option(
        Struct(
            passed=Bool(),
            ended_ns=Option(I64),
            length_s=F64(),
            items=Seq(
                Struct(
                    name=Text(),
                    value=Option(F64()),
                    at_least=Option(F64()),
                    at_most=Option(F64()),
                    unit_of_measure=Text(),
                    passed=Bool(),
                ),
                256,
            ),
        )
    ),
    pre_launch=Option(
        Struct(
            elapsed_s=F64(),
            duration_s=F64(),
            gyros=Seq(Struct(name=Text(), modes=PRE_LAUNCH_MODES, sigma_rad_per_s=Option(F64())), 8),
        )
    ),
    pre_launch_outcome=Option(
        Struct(
            ended_ns=Option(I64),
            verdict=Enum(accepted=Seq(CONSTANTS, 8), refused=Seq(Text(), 64), aborted=None),
            overlay=Option(Digest(32)),
        )
    ),
    counters=Seq(COUNTER, 256),
    faults=Seq(FAULT, 32),
    last_fault=Option(Text()),
    latency=Struct(
        p50_ns=U64,
        p99_ns=U64,
        p999_ns=U64,
        max_ns=U64,
        buckets=Seq(Struct(up_to_ns=U64, count=U64), 1024),
    ),
)

SERVICE_STATUS_BODY = Struct(
    instance=Text(),
    version=Text(),
    pid=Option(U32),
    started_unix_ms=I64,
    uptime_s=F64(),
    units=Seq(Struct(unit=Text(), state=STATE, output=OUTPUT), 4096),
    calibrations=Option(
        Struct(path=Text(), state=Enum("watching", "polling", "gone"), reason=Option(Text())),
    ),
    bad_documents=Seq(Struct(file=Text(), problem=Text(), problems=U64), 64),
    store=Option(Struct(path=Text(), audit_entries=U64)),
    faults=Seq(FAULT, 32),
    settings_digest=Option(Digest(32)),
    swaps_accepted=U64,
    swaps_refused=U64,
)

# The entry in the parts is left as bytes.
JOURNAL_PART = Struct(unit=Text(), instance=Text(), number=U64, part=U32, parts=U32, bytes=Seq(Byte(), 512 << 10))

RAW_GYRO, RAW_ACCEL, RAW_TEMPERATURE, CORRECTED, STATUS, RAW_HEALTH, SERVICE_STATUS, REFERENCE, JOURNAL = range(1, 10)
# By kind, then by version; the highest version is the one that is written.
BODIES = {
    RAW_GYRO: {1: GYRO_BATCH},
    RAW_ACCEL: {1: ACCEL_BATCH},
    RAW_TEMPERATURE: {1: TEMPERATURE_BATCH},
    CORRECTED: {1: CORRECTED_BATCH},
    STATUS: {1: STATUS_1, 2: STATUS_2},
    RAW_HEALTH: {1: HEALTH_BATCH},
    SERVICE_STATUS: {1: SERVICE_STATUS_BODY},
    REFERENCE: {1: REFERENCE_BODY},
    JOURNAL: {1: JOURNAL_PART},
}


def check(kind, message):
    """What the types cannot say."""
    if kind in (STATUS, SERVICE_STATUS):
        return
    if kind == JOURNAL:
        if not 1 <= message["parts"] <= 64 or message["part"] >= message["parts"] or not message["bytes"]:
            raise Refused("a part of a journal entry that cannot be")
        return
    if kind == REFERENCE:
        rates, sigma = message["angular_rate_rad_per_s"], message["sigma_rad_per_s"]
        if message["end_ns"] <= message["start_ns"]:
            raise Refused("a reference ends before it starts")
        if not all(math.isfinite(value) for value in [*rates, sigma]) or sigma < 0:
            raise Refused("a reference has a rate or sigma that cannot be")
        return
    ticks = message["ticks"]
    if not 1 <= len(ticks) <= MAX_TICKS:
        raise Refused(f"a batch has {len(ticks)} ticks")
    if kind == RAW_TEMPERATURE and any(len(tick["raw"]) != len(message["channels"]) for tick in ticks):
        raise Refused("a tick has not one reading per channel")
    if kind in (RAW_GYRO, RAW_ACCEL):
        shapes = {(name, len(values)) for tick in ticks for name, values in tick["readings"].items()}
        if len(shapes) > 1:
            raise Refused("kind or number of readings differ within a batch")
    if kind == RAW_GYRO:
        sensors = len(next(iter(ticks[0]["readings"].values())))
        if any(len(tick["half_periods"]) not in (0, sensors) for tick in ticks):
            raise Refused("half-period counts of another number of gyros")


def decode(frame, kind):
    """The message in a frame of a key on which messages of `kind` are published; raises `Refused`."""
    if not 6 <= len(frame) <= MAX_FRAME:
        raise Refused(f"a frame has {len(frame)} bytes")
    if frame[0] != kind:
        raise Refused(f"kind is {frame[0]}, expected {kind}")
    body = BODIES[kind].get(frame[1])
    if body is None:
        raise Refused(f"version {frame[1]} of kind {kind} is not known")
    if zlib.crc32(frame[:-4]) != int.from_bytes(frame[-4:], "little"):
        raise Refused("the checksum does not fit")
    cursor = Cursor(frame[2:-4])
    message = body.read(cursor)
    if cursor.at < len(cursor.data):
        raise Refused(f"{len(cursor.data) - cursor.at} bytes are left over")
    check(kind, message)
    return message


def encode(message, kind, version=None):
    """The frame of a message, in the current version where none is stated."""
    check(kind, message)
    version = version or max(BODIES[kind])
    frame = bytearray([kind, version])
    BODIES[kind][version].write(frame, message)
    frame += zlib.crc32(frame).to_bytes(4, "little")
    return bytes(frame)
