"""Recordings, Parquet tables and wire files as arrays."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any, Iterable, Iterator, Union

import numpy as np

from . import _layout as layout
from ._account import Account
from ._arrays import TICK, Array, CorrectedDecoder
from ._rules import Message, Refused
from ._wire import decode

Path = Union[str, "os.PathLike[str]"]

#: A raw gyro tick of a recording; `mode` and `meander` as in `TICK`, absent readings NaN.
RAW_GYRO_TICK = np.dtype(
    [
        ("sequence", "<u8"),
        ("series", "<u8"),
        ("end_time_ns", "<i8"),
        ("duration_ns", "<u8"),
        ("sensors", "u1"),
        ("readings", "<f8", (layout.SENSORS,)),
        ("mode", "i1"),
        ("switch_command", "?"),
        ("meander", "i1"),
        ("half_periods", "<i4", (layout.SENSORS, 2)),
    ]
)
#: A raw accelerometer tick of a recording.
RAW_ACCEL_TICK = np.dtype(
    [
        ("sequence", "<u8"),
        ("end_time_ns", "<i8"),
        ("duration_ns", "<u8"),
        ("sensors", "u1"),
        ("readings", "<f8", (layout.SENSORS,)),
    ]
)
#: A temperature reading of a recording.
TEMPERATURE_READING = np.dtype([("time_ns", "<i8"), ("raw", "<f8")])
_MODES = {None: 0, "Plus": 1, "Minus": -1}


class Unreadable(OSError):
    """A file that cannot be read, or not to its end."""


@dataclass
class Recording:
    """What recordings hold, by unit."""

    #: Outputs, of type `TICK`.
    corrected: dict[str, Array] = field(default_factory=dict)
    #: Calibration's counter of each output.
    revisions: dict[str, Array] = field(default_factory=dict)
    raw_gyro: dict[str, Array] = field(default_factory=dict)
    raw_accel: dict[str, Array] = field(default_factory=dict)
    #: By unit, then by channel.
    raw_temperature: dict[str, dict[str, Array]] = field(default_factory=dict)
    status: dict[str, list[Message]] = field(default_factory=dict)
    #: Continuity of the corrected outputs.
    accounts: dict[str, Account] = field(default_factory=dict)
    #: Frames that could not be read, in words: topic and why.
    refused: list[str] = field(default_factory=list)


class _Collector:
    """Gathers messages into a `Recording`."""

    def __init__(self, units: set[str] | None) -> None:
        self.recording = Recording()
        self._units = units
        self._decoder = CorrectedDecoder()
        self._parts: dict[tuple[str, str], list[Any]] = {}

    def add(self, topic: str, frame: bytes) -> None:
        words = topic.split("/")
        # A namespace may stand before.
        if "imu" not in words:
            return
        _, unit, *stream = words[words.index("imu") :] + [""]
        if self._units is not None and unit not in self._units:
            return
        try:
            self._take(unit, "/".join(stream[:-1]), frame)
        except Refused as error:
            self.recording.refused.append(f"{topic}: {error}")

    def _take(self, unit: str, stream: str, frame: bytes) -> None:
        parts = self._parts
        if stream == "corrected":
            batch = self._decoder.decode(frame)
            parts.setdefault((stream, unit), []).append(batch.ticks)
            parts.setdefault(("revision", unit), []).append(np.full(len(batch.ticks), batch.revision, np.uint64))
            self.recording.accounts.setdefault(unit, Account()).enter(batch.ticks, batch.series)
        elif stream == "raw/gyro":
            parts.setdefault((stream, unit), []).append(_gyro(decode(frame, layout.RAW_GYRO)))
        elif stream == "raw/accel":
            parts.setdefault((stream, unit), []).append(_accel(decode(frame, layout.RAW_ACCEL)))
        elif stream == "raw/temp":
            message = decode(frame, layout.RAW_TEMPERATURE)
            for index, channel in enumerate(message["channels"]):
                rows = [(tick["time_ns"], tick["raw"][index]) for tick in message["ticks"]]
                parts.setdefault((f"temperature {channel}", unit), []).append(np.array(rows, TEMPERATURE_READING))
        elif stream == "status":
            self.recording.status.setdefault(unit, []).append(decode(frame, layout.STATUS))

    def finish(self) -> Recording:
        recording = self.recording
        places = {
            "corrected": recording.corrected,
            "revision": recording.revisions,
            "raw/gyro": recording.raw_gyro,
            "raw/accel": recording.raw_accel,
        }
        for (stream, unit), parts in self._parts.items():
            if stream in places:
                places[stream][unit] = np.concatenate(parts)
            else:
                channel = stream.split(" ", 1)[1]
                recording.raw_temperature.setdefault(unit, {})[channel] = np.concatenate(parts)
        return recording


def read_recording(*paths: Path, units: Iterable[str] | None = None) -> Recording:
    """What MCAP recordings hold, of all units or some. Several files are read in sequence. Needs `isotherm[recordings]`.

    Raises `Unreadable` for a file that is no MCAP or was cut short: repair it with `isotherm-replay recover`.
    """
    try:
        from mcap.exceptions import McapError
        from mcap.stream_reader import StreamReader
        from mcap.records import Channel, Message as Record
    except ImportError:
        raise ImportError("reading recordings needs the package mcap: pip install isotherm[recordings]") from None
    collector = _Collector(None if units is None else set(units))
    for path in paths:
        topics: dict[int, str] = {}
        try:
            with open(path, "rb") as file:
                for record in StreamReader(file).records:
                    if isinstance(record, Channel):
                        topics[record.id] = record.topic
                    elif isinstance(record, Record):
                        collector.add(topics[record.channel_id], bytes(record.data))
        except OSError:
            raise
        except (McapError, EOFError, KeyError, ValueError, RuntimeError) as error:
            words = f"{os.fspath(path)}: no recording, or cut short; try isotherm-replay recover ({type(error).__name__}: {error})"
            raise Unreadable(words) from None
    return collector.finish()


def read_wire(path: Path) -> Iterator[bytes]:
    """The frames of a file of `isotherm-replay correct --format wire`; decode them with `CorrectedDecoder`."""
    with open(path, "rb") as file:
        place = 0
        while head := file.read(4):
            length = int.from_bytes(head, "little")
            if length > layout.FRAME_BYTES:
                raise Unreadable(f"{os.fspath(path)}: at byte {place} a frame of {length} bytes, at most {layout.FRAME_BYTES}")
            frame = file.read(length)
            if len(head) < 4 or len(frame) < length:
                raise Unreadable(f"{os.fspath(path)}: cut short in the frame at byte {place}")
            place += 4 + length
            yield frame


def read_parquet(path: Path) -> Array:
    """A table of `isotherm-replay convert --to parquet`; needs `isotherm[parquet]`.

    `corrected.parquet` becomes an array of type `TICK`; any other one with the columns of the file, absent values NaN or 0.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ImportError("reading Parquet needs the package pyarrow: pip install isotherm[parquet]") from None
    try:
        table = pyarrow.parquet.read_table(path)
    except pyarrow.ArrowInvalid as error:
        raise Unreadable(f"{os.fspath(path)}: no Parquet file, or cut short ({error})") from None
    columns = {name: _column(table.column(name)) for name in table.column_names}
    if "delta_angle_x_rad" in columns:
        return _ticks(columns, len(table))
    array = np.zeros(len(table), [(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        array[name] = values
    return array


def _column(column: Any) -> Array:
    import pyarrow

    if pyarrow.types.is_integer(column.type) or pyarrow.types.is_boolean(column.type):
        column = column.fill_null(False if pyarrow.types.is_boolean(column.type) else 0)
    return np.asarray(column.to_numpy())


def _ticks(columns: dict[str, Array], count: int) -> Array:
    ticks = np.zeros(count, TICK)
    for name in ("sequence", "end_time_ns", "duration_ns", "ticks", "missed", "mode", "flags"):
        ticks[name] = columns[name]
    for index, axis in enumerate("xyz"):
        ticks["delta_angle_rad"][:, index] = columns[f"delta_angle_{axis}_rad"]
        ticks["delta_velocity_m_per_s"][:, index] = columns[f"delta_velocity_{axis}_m_per_s"]
    for kind, number, unit in (("gyro", "gyros", "rad_per_s"), ("accel", "accels", "m_per_s2")):
        parity = ticks[f"{kind}_parity_{unit}"]
        parity[:] = np.nan
        for index in range(layout.SENSORS):
            if f"{kind}_{index}_flags" in columns:
                ticks[f"{kind}_flags"][:, index] = columns[f"{kind}_{index}_flags"]
                ticks[number] = index + 1
        for index in range(layout.PARITY):
            if f"{kind}_parity_{index}_{unit}" in columns:
                parity[:, index] = columns[f"{kind}_parity_{index}_{unit}"]
    for increment, unit in (("angle", "rad"), ("velocity", "m_per_s")):
        sigma = ticks[f"{increment}_sigma_{unit}"]
        sigma[:] = np.nan
        for row, cause in enumerate(("noise", "restoration", "calibration", "clamping")):
            for index, axis in enumerate("xyz"):
                column = f"{increment}_{cause}_sigma_{axis}_{unit}"
                if column in columns:
                    sigma[:, row, index] = columns[column]
    return ticks


def _fill(array: Array, message: Message) -> Array:
    array["sequence"] = np.uint64(message["first_sequence"]) + np.arange(len(array), dtype=np.uint64)
    array["readings"] = np.nan
    for row, tick in zip(array, message["ticks"]):
        (readings,) = tick["readings"].values()
        row["end_time_ns"], row["duration_ns"], row["sensors"] = tick["end_time_ns"], tick["duration_ns"], len(readings)
        row["readings"][: len(readings)] = readings
    return array


def _gyro(message: Message) -> Array:
    array = _fill(np.zeros(len(message["ticks"]), RAW_GYRO_TICK), message)
    array["series"] = message["series"]
    for row, tick in zip(array, message["ticks"]):
        row["mode"], row["meander"] = _MODES[tick["mode"]], _MODES[tick["meander"]]
        row["switch_command"] = tick["switch_command"]
        for index, half in enumerate(tick["half_periods"]):
            row["half_periods"][index] = (half["positive"], half["negative"])
    return array


def _accel(message: Message) -> Array:
    return _fill(np.zeros(len(message["ticks"]), RAW_ACCEL_TICK), message)
