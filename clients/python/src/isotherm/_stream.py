"""Streams of messages: Zenoh's thread hands the bytes over, the user's thread decodes them."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from dataclasses import replace
from typing import Any, Callable, Generic, Iterator, TypeVar

import zenoh

from . import _layout as layout
from ._account import Account, FirstWins
from ._arrays import CorrectedBatch, CorrectedDecoder
from ._rules import Message, Refused
from ._threads import for_each, start
from ._wire import decode

M = TypeVar("M")
_LOG = logging.getLogger("isotherm")


class Stream(Iterator[M], Generic[M]):
    """Messages of a key in their order of arrival. A frame that cannot be read is counted and passed over."""

    def __init__(self, session: zenoh.Session, key: str, most_waiting: int | None, timeout_s: float | None) -> None:
        if most_waiting is not None and most_waiting < 1:
            raise ValueError(f"most_waiting is {most_waiting}, must be at least 1, or None")
        self._key = key
        self._timeout_s = timeout_s
        self._most_waiting = most_waiting
        self._waiting: deque[tuple[str, bytes]] = deque()
        self._changed = threading.Condition()
        self.closed = False
        #: Frames that could not be read.
        self.refused = 0
        #: Why the last of them could not, in words.
        self.last_refusal: str | None = None
        #: Messages dropped since more than `most_waiting` waited.
        self.messages_dropped = 0
        self._subscriber = session.declare_subscriber(key)
        self._receiver = for_each(self._subscriber, self._receive, f"{key} in")

    def _receive(self, sample: zenoh.Sample) -> None:
        message = (str(sample.key_expr), sample.payload.to_bytes())
        with self._changed:
            if self._most_waiting is not None and len(self._waiting) >= self._most_waiting:
                self._waiting.popleft()
                self.messages_dropped += 1
            self._waiting.append(message)
            self._changed.notify()

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the subscription; what waits can still be taken."""
        with self._changed:
            if self.closed:
                return
            self.closed = True
            self._changed.notify_all()
        self._subscriber.undeclare()
        self._receiver.join()

    def __next__(self) -> M:
        message = self.take(self._timeout_s)
        if message is not None:
            return message
        if self.closed:
            raise StopIteration
        raise TimeoutError(f"{self._key}: no message for {self._timeout_s} s; is the unit sending? (isotherm status)")

    def take(self, timeout_s: float | None = None) -> M | None:
        """The next message; None once the stream is closed and empty, or after `timeout_s` without one."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            with self._changed:
                while not self._waiting:
                    left = None if deadline is None else deadline - time.monotonic()
                    if self.closed or (left is not None and left <= 0):
                        return None
                    self._changed.wait(left)
                key, frame = self._waiting.popleft()
            try:
                message = self._read(key, frame)
            except Refused as error:
                self.refused += 1
                self.last_refusal = f"{key}: {error}"
                continue
            if message is not None:
                return message

    def _read(self, key: str, frame: bytes) -> M | None:
        raise NotImplementedError


class CorrectedStream(Stream[CorrectedBatch]):
    """Corrected batches, with an account of each unit."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        first_wins: bool,
        callback: Callable[[CorrectedBatch], Any] | None,
        most_waiting: int | None,
        timeout_s: float | None,
    ) -> None:
        #: Account of each unit heard of.
        self.accounts: dict[str, Account] = {}
        self._first_wins = first_wins
        self._arbiters: dict[str, FirstWins] = {}
        self._decoders: dict[str, CorrectedDecoder] = {}
        #: What the callback raised last, and how often it has raised.
        self.error: Exception | None = None
        self.errors = 0
        super().__init__(session, key, most_waiting, timeout_s)
        self._thread: threading.Thread | None = None
        if callback is not None:
            self._thread = start(lambda: self._call(callback), key)

    def _call(self, callback: Callable[[CorrectedBatch], Any]) -> None:
        while (batch := self.take()) is not None:
            try:
                callback(batch)
            except Exception as error:
                self.error = error
                self.errors += 1
                _LOG.exception("%s: the callback has raised; the stream goes on", self._key)

    def close(self) -> None:
        super().close()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    @property
    def outputs_dropped(self) -> int:
        """Outputs dropped since another service's had come first."""
        return sum(arbiter.dropped for arbiter in list(self._arbiters.values()))

    def _read(self, key: str, frame: bytes) -> CorrectedBatch | None:
        batch = self._decoders.setdefault(key, CorrectedDecoder()).decode(frame)
        if not key.endswith(f"imu/{batch.unit}/corrected"):
            raise Refused(f"it is of unit {batch.unit!r}")
        if self._first_wins:
            ticks = self._arbiters.setdefault(batch.unit, FirstWins()).choose(batch.ticks, batch.series)
            if len(ticks) == 0:
                return None
            if len(ticks) < len(batch.ticks):
                batch = replace(batch, ticks=ticks)
        self.accounts.setdefault(batch.unit, Account()).enter(batch.ticks, batch.series)
        return batch


class StatusStream(Stream[Message]):
    """Status messages as dicts, with the field names of docs/wire.md."""

    def __init__(self, session: zenoh.Session, key: str, timeout_s: float | None) -> None:
        super().__init__(session, key, None, timeout_s)

    def _read(self, key: str, frame: bytes) -> Message:
        return decode(frame, layout.STATUS)
