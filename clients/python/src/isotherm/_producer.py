"""Publishing a unit's raw ticks in the order that the service needs, without outrunning it."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from types import TracebackType
from typing import Any, Mapping, Sequence

import numpy as np
import zenoh

from . import _layout as layout
from ._arrays import CorrectedBatch, CorrectedDecoder
from ._match import wait_until_matched
from ._rules import Message, Refused
from ._threads import for_each
from ._wire import encode

_MODES: dict[Any, Any] = {None: None, 0: None, 1: "Plus", -1: "Minus", "Plus": "Plus", "Minus": "Minus"}
_LEAST_IN_FLIGHT = 256
# In the order of publication.
_KINDS = {"temp": layout.RAW_TEMPERATURE, "accel": layout.RAW_ACCEL, "gyro": layout.RAW_GYRO}
#: How long `close` waits for ticks to come back (s).
CLOSE_S = 1.0
_LOG = logging.getLogger("isotherm")


class Producer:
    """Publishes the raw ticks of one unit; use it in a `with` statement, which flushes and closes at its end.

    Hand over what happened in the order of time: at equal times temperatures, then accelerometer, then gyro ticks. A gyro batch goes
    out when it has `batch_ticks` (1…4096); what was handed over before goes out first. Congestion blocks. What is published while nobody
    subscribes is lost: `unheard` counts it, and a warning is logged. What is on its way when a connection breaks is lost uncounted. With
    `max_in_flight`, nothing is lost unseen: `gyro` waits while more ticks than that have not come back corrected (at least two batches and 256). If nothing
    comes back, `TimeoutError` names the ticks that were sent; these are not waited for any more. A tick is taken whatever is raised:
    what could not be sent goes with the next batch. Only a batch that cannot be encoded is given up (`Refused` names it).
    `series` is the number of this run (default: the time now): sequence and clock may start anywhere.
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
        #: Of these, published while nobody subscribed.
        self.unheard = 0
        self._is_heard = True
        self.closed = False
        self._session = session
        self._batch_ticks = batch_ticks
        self._max_in_flight = max_in_flight
        self._timeout_s = timeout_s
        # Batches that have not been sent.
        self._waiting: dict[str, deque[Message]] = {stream: deque() for stream in _KINDS}
        self._next = {"gyro": 0, "accel": 0}
        self._back = threading.Condition()
        self._first_sent: int | None = None
        self._last_sent = self._last_back = -1
        self._decoder = CorrectedDecoder()
        self._subscriber = None
        if max_in_flight is not None:
            self._subscriber = session.declare_subscriber(f"imu/{unit}/corrected")
            for_each(self._subscriber, self._came_back, f"imu/{unit}/corrected back")
        self._publishers = {stream: self._declare(stream) for stream in _KINDS}

    def _declare(self, stream: str) -> zenoh.Publisher:
        key = f"imu/{self.unit}/raw/{stream}"
        publisher = self._session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK, priority=zenoh.Priority.REAL_TIME
        )
        if not wait_until_matched(publisher, self._timeout_s):
            raise TimeoutError(f"{key}: nobody subscribes within {self._timeout_s:g} s; is one connected here that takes the unit? (isotherm status)")
        return publisher

    def __enter__(self) -> Producer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            if kind is None:
                self.flush()
        finally:
            self.close()

    def close(self) -> None:
        """Flushes and ends the publication. Raises nothing: what cannot be sent within `CLOSE_S` is logged (`isotherm`)."""
        if self.closed:
            return
        self.closed = True
        self._timeout_s = min(self._timeout_s, CLOSE_S)
        try:
            self.flush()
        except Exception as error:
            lost = ", ".join(_named(stream, batch) for stream, waiting in self._waiting.items() for batch in waiting)
            _LOG.error("%s: closed, not sent: %s (%s)", self.unit, lost or "nothing else", error)
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
        self._take("gyro", tick, sequence, self._batch_ticks)

    def accel(self, end_time_ns: int, duration_ns: int, readings: Sequence[float], *, sequence: int | None = None) -> None:
        """Takes an accelerometer tick; its numbers are independent of the gyros'."""
        tick = {"end_time_ns": int(end_time_ns), "duration_ns": int(duration_ns), "readings": _readings(readings)}
        self._take("accel", tick, sequence, layout.TICKS)

    def temperatures(self, time_ns: int, readings: Mapping[str, float]) -> None:
        """Takes temperature readings of a time, by channel, in the document's unit of measure."""
        waiting, channels = self._waiting["temp"], list(readings)
        if not waiting or waiting[-1]["channels"] != channels or len(waiting[-1]["ticks"]) >= layout.TICKS:
            waiting.append({"channels": channels, "ticks": []})
        ticks = waiting[-1]["ticks"]
        ticks.append({"time_ns": int(time_ns), "raw": [float(value) for value in readings.values()]})
        if len(ticks) >= layout.TICKS:
            self.flush()

    def health(self, time_ns: int, readings: Mapping[str, float]) -> None:
        """Publishes voltages and counters of a time at once, for the self-test."""
        named = [{"name": name, "value": float(value)} for name, value in readings.items()]
        frame = encode({"ticks": [{"time_ns": int(time_ns), "readings": named}]}, layout.RAW_HEALTH)
        congestion, priority = zenoh.CongestionControl.BLOCK, zenoh.Priority.REAL_TIME
        self._session.put(f"imu/{self.unit}/raw/health", frame, congestion_control=congestion, priority=priority)

    def flush(self) -> None:
        """Publishes everything that was handed over, full batch or not."""
        for stream, waiting in self._waiting.items():
            while waiting:
                try:
                    self._send(stream, waiting[0])
                except Refused as error:
                    raise Refused(f"imu/{self.unit}/raw/{stream}: not sent: {_named(stream, waiting.popleft())}: {error}") from None
                waiting.popleft()

    def _send(self, stream: str, batch: Message) -> None:
        frame = encode(batch, _KINDS[stream])
        if stream == "gyro":
            first, count = batch["first_sequence"], len(batch["ticks"])
            if self._max_in_flight is not None:
                self._wait_below(self._max_in_flight + 1 - count)
            with self._back:
                if self._first_sent is None:
                    self._first_sent, self._last_back = first, first - 1
                self._last_sent = first + count - 1
            self._note_heard(first, count)
            self._publishers[stream].put(frame)
            self.sent += count
        else:
            self._publishers[stream].put(frame)

    def _note_heard(self, first: int, count: int) -> None:
        # The package's types take the status for a bool.
        publisher: Any = self._publishers["gyro"]
        is_heard = bool(publisher.matching_status.matching)
        if not is_heard:
            self.unheard += count
            if self._is_heard:
                _LOG.warning("%s: nobody subscribes: gyro ticks from %d on are lost until a service is connected", self.unit, first)
        elif not self._is_heard:
            _LOG.warning("%s: a service subscribes again, from gyro tick %d on", self.unit, first)
        self._is_heard = is_heard

    def drain(self) -> None:
        """Flushes, and waits until every tick has come back; only with `max_in_flight`.

        The last ones come back when the service has noticed by its clock that the stream has stopped
        (0.5 s, or four times the distance of messages; 1 s after the first few).
        """
        self.flush()
        if self._max_in_flight is None:
            raise ValueError("drain needs max_in_flight: without it nothing is waited for")
        self._wait_below(1)

    @property
    def in_flight(self) -> int:
        """Gyro ticks published that have not come back; 0 without `max_in_flight`."""
        return 0 if self._max_in_flight is None else self._last_sent - self._last_back

    def _take(self, stream: str, tick: Message, sequence: int | None, most: int) -> None:
        number = self._next[stream] if sequence is None else int(sequence)
        waiting = self._waiting[stream]
        # The numbers in a batch are consecutive and its readings alike.
        goes_on = bool(waiting) and number == self._next[stream] and _shape(waiting[-1]["ticks"][0]) == _shape(tick)
        try:
            if waiting and not goes_on:
                self.flush()
        finally:
            if not goes_on or len(waiting[-1]["ticks"]) >= most:
                waiting.append({"first_sequence": number, "series": self.series, "ticks": []})
            ticks = waiting[-1]["ticks"]
            ticks.append(tick)
            self._next[stream] = number + 1
        if len(ticks) >= most:
            self.flush()

    def _came_back(self, sample: zenoh.Sample) -> None:
        try:
            batch: CorrectedBatch = self._decoder.decode(sample.payload.to_bytes())
        except Refused:
            return  # It acknowledges nothing.
        if batch.series != self.series:
            return  # Another run's.
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
                    sent = f"{self._last_back + 1}…{self._last_sent}"
                    # Where a service was restarted these will never come.
                    self._last_back = self._last_sent
                    waiting = sum(len(batch["ticks"]) for batch in self._waiting["gyro"])
                    raise TimeoutError(
                        f"imu/{self.unit}/corrected: gyro ticks {sent} were sent and none came back for {self._timeout_s:g} s; "
                        f"{waiting} more wait to be sent; is the unit running? (isotherm status)"
                    )


def _readings(readings: Sequence[float]) -> dict[str, list[Any]]:
    array = np.asarray(readings)
    if array.dtype.kind in "iu" and array.size > 0:
        return {"Counts": array.tolist()}
    return {"Means": array.astype(np.float64).tolist()}


def _shape(tick: Message) -> tuple[str, int]:
    ((variant, readings),) = tick["readings"].items()
    return variant, len(readings)


def _named(stream: str, batch: Message) -> str:
    """Which ticks a batch has."""
    ticks = batch["ticks"]
    if stream == "temp":
        return f"temperatures of {ticks[0]['time_ns']}…{ticks[-1]['time_ns']} ns"
    return f"{stream} ticks {batch['first_sequence']}…{batch['first_sequence'] + len(ticks) - 1}"
