"""Publishing a unit's raw ticks in the order that the service needs, without outrunning it."""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import Any, Mapping, Sequence

import numpy as np
import zenoh

from . import _layout as layout
from ._arrays import CorrectedBatch, CorrectedDecoder
from ._match import wait_until_matched
from ._rules import Message, Refused
from ._wire import encode

_MODES: dict[Any, Any] = {None: None, 0: None, 1: "Plus", -1: "Minus", "Plus": "Plus", "Minus": "Minus"}
_LEAST_IN_FLIGHT = 256


class Producer:
    """Publishes the raw ticks of one unit; use it in a `with` statement, which flushes at its end.

    Hand over what happened in the order of time: at equal times temperatures, then accelerometer, then gyro ticks. A gyro batch goes
    out when it has `batch_ticks` (1…4096); what was handed over before goes out first. Congestion blocks: nothing is dropped. With
    `max_in_flight`, `gyro` waits while more ticks than that have not come back corrected (at least two batches and 256; `TimeoutError`
    if nothing comes back). `series` is the number of this run (default: the time now): sequence and clock may start anywhere.
    Readings that are whole numbers (`int`, integer arrays) are counts, others means. Times are ns on one monotonic clock of the unit.
    """

    def __init__(
        self,
        session: zenoh.Session,
        unit: str,
        batch_ticks: int,
        max_in_flight: int | None,
        series: int | None,
        timeout_s: float,
    ) -> None:
        if not 1 <= batch_ticks <= layout.TICKS:
            raise ValueError(f"batch_ticks is {batch_ticks}, must be 1 to {layout.TICKS}")
        least = max(2 * batch_ticks, _LEAST_IN_FLIGHT)
        if max_in_flight is not None and max_in_flight < least:
            raise ValueError(f"max_in_flight is {max_in_flight}, must be at least {least}: a unit holds ticks inside")
        self.unit = unit
        #: Number of this run.
        self.series = time.time_ns() if series is None else series
        #: Gyro ticks published.
        self.sent = 0
        self._session = session
        self._batch_ticks = batch_ticks
        self._max_in_flight = max_in_flight
        self._timeout_s = timeout_s
        self._pending: dict[str, list[Message]] = {"gyro": [], "accel": []}
        self._temperatures: list[tuple[int, dict[str, float]]] = []
        self._first = {"gyro": 0, "accel": 0}
        self._next = {"gyro": 0, "accel": 0}
        self._back = threading.Condition()
        self._first_sent: int | None = None
        self._last_sent = self._last_back = -1
        self._decoder = CorrectedDecoder()
        self._subscriber = None
        if max_in_flight is not None:
            self._subscriber = session.declare_subscriber(f"imu/{unit}/corrected", self._came_back)
        self._publishers = {name: self._declare(name) for name in ("temp", "accel", "gyro")}

    def _declare(self, stream: str) -> zenoh.Publisher:
        key = f"imu/{self.unit}/raw/{stream}"
        publisher = self._session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK, priority=zenoh.Priority.REAL_TIME
        )
        if not wait_until_matched(publisher, self._timeout_s):
            raise TimeoutError(f"{key}: nobody subscribes within {self._timeout_s:g} s; is a service connected here?")
        return publisher

    def __enter__(self) -> Producer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self.flush()
        self.close()

    def close(self) -> None:
        """Ends the publication; what was not flushed is not sent."""
        for publisher in self._publishers.values():
            publisher.undeclare()
        if self._subscriber is not None:
            self._subscriber.undeclare()

    def gyro(
        self,
        end_time_ns: int,
        duration_ns: int,
        readings: Sequence[float],
        *,
        sequence: int | None = None,
        mode: int | str | None = None,
        switch_command: bool = False,
        meander: int | str | None = None,
        half_periods: Sequence[tuple[int, int]] = (),
    ) -> None:
        """Takes a gyro tick; `sequence` goes on from the last by default. Modes are +1 and -1, or "Plus" and "Minus".

        `half_periods` has the counts of the tick's first half and of its second, for each gyro or none.
        """
        tick = {
            "end_time_ns": int(end_time_ns),
            "duration_ns": int(duration_ns),
            "readings": _readings(readings),
            "mode": _MODES[mode],
            "switch_command": bool(switch_command),
            "meander": _MODES[meander],
            "half_periods": [{"positive": int(first), "negative": int(second)} for first, second in half_periods],
        }
        self._add("gyro", tick, sequence, self._batch_ticks)

    def accel(self, end_time_ns: int, duration_ns: int, readings: Sequence[float], *, sequence: int | None = None) -> None:
        """Takes an accelerometer tick; its numbers are independent of the gyros'."""
        tick = {"end_time_ns": int(end_time_ns), "duration_ns": int(duration_ns), "readings": _readings(readings)}
        self._add("accel", tick, sequence, layout.TICKS)

    def temperatures(self, time_ns: int, readings: Mapping[str, float]) -> None:
        """Takes temperature readings of a time, by channel, in the document's unit of measure."""
        self._temperatures.append((int(time_ns), {name: float(value) for name, value in readings.items()}))
        if len(self._temperatures) >= layout.TICKS:
            self.flush()

    def health(self, time_ns: int, readings: Mapping[str, float]) -> None:
        """Publishes voltages and counters of a time at once, for the self-test."""
        named = [{"name": name, "value": float(value)} for name, value in readings.items()]
        frame = encode({"ticks": [{"time_ns": int(time_ns), "readings": named}]}, layout.RAW_HEALTH)
        congestion, priority = zenoh.CongestionControl.BLOCK, zenoh.Priority.REAL_TIME
        self._session.put(f"imu/{self.unit}/raw/health", frame, congestion_control=congestion, priority=priority)

    def flush(self) -> None:
        """Publishes everything that was handed over, full batch or not."""
        while self._temperatures:
            channels = list(self._temperatures[0][1])
            count = next(
                (index for index, (_, row) in enumerate(self._temperatures) if list(row) != channels), len(self._temperatures)
            )
            rows, self._temperatures = self._temperatures[:count], self._temperatures[count:]
            readings = [{"time_ns": time_ns, "raw": list(row.values())} for time_ns, row in rows]
            self._publishers["temp"].put(encode({"channels": channels, "ticks": readings}, layout.RAW_TEMPERATURE))
        ticks, self._pending["accel"] = self._pending["accel"], []
        if ticks:
            self._publishers["accel"].put(encode({"first_sequence": self._first["accel"], "ticks": ticks}, layout.RAW_ACCEL))
        ticks, self._pending["gyro"] = self._pending["gyro"], []
        if ticks:
            first = self._first["gyro"]
            frame = encode({"first_sequence": first, "series": self.series, "ticks": ticks}, layout.RAW_GYRO)
            if self._max_in_flight is not None:
                self._wait_below(self._max_in_flight + 1 - len(ticks))
            with self._back:
                if self._first_sent is None:
                    self._first_sent, self._last_back = first, first - 1
                self._last_sent = first + len(ticks) - 1
            self._publishers["gyro"].put(frame)
            self.sent += len(ticks)

    def drain(self) -> None:
        """Flushes, and waits until every tick has come back; only with `max_in_flight`.

        The last ones come back when the service has noticed by its clock that the stream has stopped (0.5 s).
        """
        self.flush()
        if self._max_in_flight is None:
            raise ValueError("drain needs max_in_flight: without it nothing is waited for")
        self._wait_below(1)

    @property
    def in_flight(self) -> int:
        """Gyro ticks published that have not come back; 0 without `max_in_flight`."""
        return 0 if self._max_in_flight is None else self._last_sent - self._last_back

    def _add(self, stream: str, tick: Message, sequence: int | None, most: int) -> None:
        number = self._next[stream] if sequence is None else int(sequence)
        pending = self._pending[stream]
        # The numbers in a batch are consecutive and its readings alike.
        if pending and (number != self._next[stream] or _shape(pending[0]) != _shape(tick)):
            self.flush()
        if not self._pending[stream]:
            self._first[stream] = number
        self._pending[stream].append(tick)
        self._next[stream] = number + 1
        if len(self._pending[stream]) >= most:
            self.flush()

    def _came_back(self, sample: zenoh.Sample) -> None:
        try:
            batch: CorrectedBatch = self._decoder.decode(sample.payload.to_bytes())
        except Refused:
            return  # It acknowledges nothing.
        with self._back:
            if self._first_sent is None:
                return
            sequences = batch.ticks["sequence"]
            ours = sequences[(sequences >= np.uint64(max(0, self._first_sent))) & (sequences <= np.uint64(self._last_sent))]
            if len(ours) > 0 and int(ours.max()) > self._last_back:
                self._last_back = int(ours.max())
                self._back.notify_all()

    def _wait_below(self, limit: int) -> None:
        with self._back:
            while self._last_sent - self._last_back >= limit:
                if not self._back.wait(self._timeout_s):
                    waiting = self._last_sent - self._last_back
                    raise TimeoutError(
                        f"imu/{self.unit}/corrected: {waiting} ticks under way and nothing came back for {self._timeout_s:g} s; "
                        "is the unit in a running state, with a calibration? (isotherm status)"
                    )


def _readings(readings: Sequence[float]) -> dict[str, list[Any]]:
    array = np.asarray(readings)
    if array.dtype.kind in "iu" and array.size > 0:
        return {"Counts": array.tolist()}
    return {"Means": array.astype(np.float64).tolist()}


def _shape(tick: Message) -> tuple[str, int]:
    ((variant, readings),) = tick["readings"].items()
    return variant, len(readings)
