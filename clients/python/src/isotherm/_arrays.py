"""Corrected batches as numpy structured arrays.

Ticks of a batch mostly have the same form: only digits differ, not lengths. The form is learned from one tick, byte by byte; the ticks
that follow it alike are then read all at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _layout as layout
from ._rules import Refused
from ._wire import body_of, codec, read_count, read_varint, take

Array = npt.NDArray[Any]

#: One output. Flags of absent sensors are 0, absent parity residuals NaN; `mode` is +1, -1, or 0 if there is none. Standard errors have a
#: row per cause (noise, restoration, calibration, clamping) and a column per axis; NaN where unknown or not asked for.
TICK = np.dtype(
    [
        ("sequence", "<u8"),
        ("end_time_ns", "<i8"),
        ("duration_ns", "<u8"),
        ("ticks", "<u2"),
        ("missed", "<u8"),
        ("delta_angle_rad", "<f8", (3,)),
        ("delta_velocity_m_per_s", "<f8", (3,)),
        ("mode", "i1"),
        ("flags", "<u2"),
        ("gyros", "u1"),
        ("gyro_flags", "u1", (layout.SENSORS,)),
        ("accels", "u1"),
        ("accel_flags", "u1", (layout.SENSORS,)),
        ("gyro_parity_rad_per_s", "<f8", (layout.PARITY,)),
        ("accel_parity_m_per_s2", "<f8", (layout.PARITY,)),
        ("angle_sigma_rad", "<f8", (4, 3)),
        ("velocity_sigma_m_per_s", "<f8", (4, 3)),
    ]
)
_COUNTS = {"gyro_flags": "gyros", "accel_flags": "accels"}
_PARITY = ("gyro_parity_rad_per_s", "accel_parity_m_per_s2")
_BLANK = np.zeros(1, TICK)
SIGMAS = ("angle_sigma_rad", "velocity_sigma_m_per_s")
for _name in _PARITY + SIGMAS:
    _BLANK[_name] = np.nan
# Forms kept: a stream has a handful, of ticks with a mode and without, before and after a number gets a digit more.
_MOST_FORMS = 16


@dataclass(frozen=True)
class CorrectedBatch:
    """Corrected ticks of one unit, all made by one calibration."""

    #: Serial of the unit.
    unit: str
    #: Counter of the calibration that made the ticks; 0 is none.
    revision: int
    #: First eight bytes of its document's SHA-256, hexadecimal.
    digest: str
    #: Channel: smoothed temperature (°C) and its rate (°C/s), at the end of the batch.
    temperatures: dict[str, tuple[float, float]]
    #: Outputs in order, of type `TICK`.
    ticks: Array = field(repr=False)
    #: The producer's run that they are of; 0 where it numbers none.
    series: int = 0

    @property
    def angular_rate_rad_per_s(self) -> Array:
        """Mean rate of each output about case x, y, z (rad/s); shape (n, 3)."""
        return angular_rate(self.ticks)

    @property
    def specific_force_m_per_s2(self) -> Array:
        """Mean specific force of each output along case x, y, z (m/s²); shape (n, 3)."""
        return specific_force(self.ticks)


def angular_rate(ticks: Array) -> Array:
    """Mean rate of each output (rad/s); shape (n, 3)."""
    return np.asarray(ticks["delta_angle_rad"] / (ticks["duration_ns"] * 1e-9)[:, None])


def specific_force(ticks: Array) -> Array:
    """Mean specific force of each output (m/s²); shape (n, 3)."""
    return np.asarray(ticks["delta_velocity_m_per_s"] / (ticks["duration_ns"] * 1e-9)[:, None])


class _Form:
    """Where the fields of a tick are, and which bytes must be as they are for that."""

    def __init__(self, body: bytes, at: int) -> None:
        self.start = at
        self.mask: list[int] = []
        # Field, bytes, whether it is signed.
        self.numbers: list[tuple[str, list[int], bool]] = []
        self.reals: list[tuple[str, int, int]] = []
        self.bytes: list[tuple[str, int, int]] = []
        self.mode: int | None = None
        constants: dict[str, int] = {}
        for name, form in layout.STRUCTS["corrected_tick"]:
            at = self._field(body, at, name, form, constants)
        self.length = at - self.start
        self.expect = np.frombuffer(body, np.uint8, self.length, self.start) & np.array(self.mask, np.uint8)
        self.mask_bytes = np.array(self.mask, np.uint8)
        self.blank = _BLANK.copy()
        for name, value in constants.items():
            self.blank[name] = value
        places = [place for _, number, _ in self.numbers for place in number]
        self.places = np.array(places)
        shifts = [7 * index for _, number, _ in self.numbers for index in range(len(number))]
        self.shifts = np.array(shifts, np.uint64)
        self.starts = np.cumsum([0, *(len(number) for _, number, _ in self.numbers)][:-1])
        names = [name for name, _, _ in self.reals]
        formats = [("<f8", (count,)) for _, _, count in self.reals]
        offsets = [offset for _, offset, _ in self.reals]
        self.view = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.length})

    def _fixed(self, count: int) -> None:
        self.mask += [0xFF] * count

    def _number(self, body: bytes, at: int, bits: int) -> tuple[int, int]:
        """Marks the bytes of a number: their highest bits say how long it is, and the last may not have more bits than the type."""
        value, end = read_varint(body, at, bits)
        spare = bits - 7 * (end - at - 1)
        self.mask += [0x80] * (end - at - 1) + [0xFF if spare <= 0 else 0xFF & ~((1 << min(spare, 7)) - 1)]
        return value, end

    def _field(self, body: bytes, at: int, name: str, form: Any, constants: dict[str, int]) -> int:
        offset = at - self.start
        if isinstance(form, str):
            _, end = self._number(body, at, int(form[1:]))
            self.numbers.append((name, list(range(offset, end - self.start)), form[0] == "i"))
            return end
        what, item = form[0], form[1]
        if what == "option":
            present, end = codec(form)[0](body, at)
            self._fixed(end - at)
            constants[name] = {None: 0, "Plus": 1, "Minus": -1}[present]
            # The mode is part of the form: there are three.
            return end
        count = form[2]
        if what == "list":
            count, end = read_count(body, at, form[2], form[3])
            self._fixed(end - at)
            at = end
        size = 8 if item == "f64" else 1
        end = take(body, at, size * count)
        self.mask += [0] * (end - at)
        if name in _COUNTS:
            constants[_COUNTS[name]] = count
        if count > 0:
            (self.reals if item == "f64" else self.bytes).append((name, at - self.start, count))
        return end

    def read(self, body: bytes, at: int, count: int) -> Array | None:
        """As many of the `count` ticks at a place as have this form; none where the first has not."""
        count = min(count, (len(body) - at) // self.length)
        if count == 0:
            return None
        rows = np.frombuffer(body, np.uint8, count * self.length, at).reshape(count, self.length)
        different = (rows & self.mask_bytes) != self.expect
        if different.any():
            count = int(different.any(axis=1).argmax())
            if count == 0:
                return None
            rows = rows[:count]
        ticks = np.repeat(self.blank, count)
        digits = (rows[:, self.places] & 0x7F).astype(np.uint64) << self.shifts
        numbers = np.add.reduceat(digits, self.starts, axis=1)
        for index, (name, _, signed) in enumerate(self.numbers):
            number = numbers[:, index]
            if signed:
                number = (number >> np.uint64(1)) ^ (np.uint64(0) - (number & np.uint64(1)))
                number = number.view(np.int64)
            ticks[name] = number
        reals = np.frombuffer(body, self.view, count, at)
        for name, _, width in self.reals:
            ticks[name][:, :width] = reals[name]
        for name, offset, width in self.bytes:
            ticks[name][:, :width] = rows[:, offset : offset + width]
        return ticks


class CorrectedDecoder:
    """Decodes corrected batches; keeps the forms of ticks that it has learned. For one thread."""

    def __init__(self) -> None:
        self._forms: list[_Form] = []

    def decode(self, frame: bytes) -> CorrectedBatch:
        """The batch in a frame; raises `Refused`, whatever the bytes are."""
        message, body = body_of(frame, layout.CORRECTED)
        sigmas: list[dict[str, Any]] = []
        head: dict[str, Any] = {}
        at = 0
        fields = dict(layout.STRUCTS[message])
        _, _, least, most = fields.pop("ticks")
        behind = fields.pop("sigmas", None)
        for name, form in fields.items():
            head[name], at = codec(form)[0](body, at)
        count, at = read_count(body, at, least, most)
        parts = []
        while count > 0:
            part, length = self._part(body, at, count)
            parts.append(part)
            count -= len(part)
            at += len(part) * length
        if behind is not None:
            sigmas, at = codec(behind)[0](body, at)
        if at != len(body):
            raise Refused(f"{len(body) - at} bytes are left over after the body")
        ticks = parts[0] if len(parts) == 1 else np.concatenate(parts)
        for run in sigmas:
            _, *numbers = run.values()
            for name, causes in zip(SIGMAS, (numbers[:4], numbers[4:])):
                ticks[name][run["from_tick"] :] = causes
        temperatures = {
            applied["channel"]: (applied["temperature_deg_c"], applied["rate_deg_c_per_s"])
            for applied in head["temperatures"]
        }
        revision = head["revision"]
        return CorrectedBatch(
            head["unit"], revision["counter"], revision["digest"], temperatures, ticks, head.get("series", 0)
        )

    def _part(self, body: bytes, at: int, count: int) -> tuple[Array, int]:
        """Ticks of one form, and the length of each."""
        for index, form in enumerate(self._forms):
            ticks = form.read(body, at, count)
            if ticks is not None:
                if index > 0:
                    self._forms.insert(0, self._forms.pop(index))
                return ticks, form.length
        form = _Form(body, at)
        self._forms.insert(0, form)
        del self._forms[_MOST_FORMS:]
        ticks = form.read(body, at, count)
        if ticks is None:
            raise AssertionError("a tick has the form that was learned from it")
        return ticks, form.length
