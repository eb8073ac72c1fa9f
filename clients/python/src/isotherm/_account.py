"""Continuity, and the arbitration of two services (docs/wire.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import Array
from ._layout import TICK_FLAGS

_RESTART = TICK_FLAGS["RESTART"]
_MOST = (1 << 64) - 1
_LONGEST_NS = 10**10
_MOST_STEPS = 1 << 20
_RUNS_BEFORE = 3


def _follows(ticks: Array) -> bool:
    """Whether the ticks of a batch follow one another, nothing missing and no restart."""
    sequence, number = ticks["sequence"], ticks["ticks"]
    plain = ((ticks["flags"] & _RESTART) == 0) & (ticks["missed"] == 0) & (number != 0)
    plain[1:] &= sequence[1:] - number[1:] == sequence[:-1]
    return bool(plain.all()) and int(sequence[0]) < _MOST - (1 << 32)


def _first(tick: Any) -> int:
    return max(0, int(tick["sequence"]) - max(0, int(tick["ticks"]) - 1))


@dataclass
class Account:
    """What of a unit's raw gyro ticks arrived, was announced as missing, or was lost on the way."""

    #: Raw ticks that arrived corrected.
    ticks: int = 0
    #: Raw ticks that outputs announced as missing.
    announced_missing: int = 0
    #: Raw ticks neither here nor announced: lost between the service and here.
    lost: int = 0
    #: Raw ticks that had been here, or had been announced as missing.
    duplicated: int = 0
    #: Times that the producer restarted.
    restarts: int = 0
    #: Sequence number of the last output.
    last_sequence: int | None = None
    #: Series of the last output.
    last_series: int = 0

    def enter(self, ticks: Array, series: int = 0) -> None:
        """Enters outputs of one series in their order of arrival; of type `TICK`."""
        if len(ticks) == 0:
            return
        if len(ticks) == 1:
            # Arrays cost more than they save.
            self._enter(ticks[0], series)
            return
        next_one = self.last_sequence is not None and _first(ticks[0]) == self.last_sequence + 1
        if next_one and series == self.last_series and _follows(ticks):
            self.ticks += int(ticks["ticks"].sum(dtype=np.uint64))
            self.last_sequence = int(ticks["sequence"][-1])
            return
        for tick in ticks:
            self._enter(tick, series)

    def _enter(self, tick: Any, series: int) -> None:
        missed, first = int(tick["missed"]), _first(tick)
        if self.last_sequence is not None and int(tick["flags"]) & _RESTART:
            self.restarts += 1
        elif self.last_sequence is not None and series == self.last_series:
            expected = min(_MOST, self.last_sequence + 1 + missed)
            self.lost += max(0, first - expected)
            self.duplicated += max(0, expected - first)
        self.ticks += max(1, int(tick["ticks"]))
        self.announced_missing += missed
        self.last_sequence, self.last_series = int(tick["sequence"]), series


@dataclass
class _Run:
    """The last tick used of a run of the producer."""

    series: int
    sequence: int
    end_time_ns: int

    def has(self, tick: Any, series: int) -> bool:
        """Whether a tick is of this run's series, and its sequence and time on this run's line."""
        if series != self.series:
            return False
        steps = int(tick["sequence"]) - self.sequence
        duration = min(int(tick["duration_ns"]) // max(1, int(tick["ticks"])), _LONGEST_NS)
        if abs(steps) > _MOST_STEPS:
            return False
        line = steps * duration
        return abs(int(tick["end_time_ns"]) - self.end_time_ns - line) <= duration // 2 + abs(line) // 8


class FirstWins:
    """Of two services that correct one unit, each tick is used from the one that sends it first.

    What is late is dropped: a tick that one service's message lost is not filled in from the other after a later one was used.
    """

    def __init__(self) -> None:
        self._current: _Run | None = None
        #: Those before it, the newest first: a service may lag behind as many restarts of the producer.
        self._before: list[_Run] = []
        #: Outputs dropped because they, or a part of them, had been used.
        self.dropped = 0

    def choose(self, ticks: Array, series: int = 0) -> Array:
        """The outputs to use, of those of one series that arrive now."""
        if len(ticks) == 1:
            return ticks if self._wins(ticks[0], series) else ticks[:0]
        stale = self._stale(ticks, series)
        self.dropped += stale
        ticks = ticks[stale:]
        if len(ticks) == 0:
            return ticks
        if self._goes_on(ticks, series):
            self._current = _Run(series, int(ticks["sequence"][-1]), int(ticks["end_time_ns"][-1]))
            return ticks
        wins = np.fromiter((self._wins(tick, series) for tick in ticks), bool, len(ticks))
        return ticks if wins.all() else ticks[wins]

    def _stale(self, ticks: Array, series: int) -> int:
        """How many ticks at the front have been used: what `_wins` finds of each, for all at once."""
        run = self._current
        if run is None or len(ticks) == 0 or _first(ticks[0]) > run.sequence or not run.has(ticks[0], series):
            return 0
        sequence, end = ticks["sequence"], ticks["end_time_ns"]
        if max(int(sequence.max()), run.sequence, int(end.max()), -int(end.min()), abs(run.end_time_ns)) >= 1 << 62:
            return 0
        number = np.maximum(ticks["ticks"], 1).astype(np.int64)
        steps = sequence.astype(np.int64) - run.sequence
        duration = np.minimum(ticks["duration_ns"] // number.astype(np.uint64), np.uint64(_LONGEST_NS)).astype(np.int64)
        near = np.abs(steps) <= _MOST_STEPS
        line = np.where(near, steps, 0) * duration
        apart = np.abs(end - run.end_time_ns - line)
        used = near & (apart <= duration // 2 + np.abs(line) // 8) & (steps - (number - 1) <= 0)
        return len(ticks) if used.all() else int(used.argmin())

    def _goes_on(self, ticks: Array, series: int) -> bool:
        """Whether every tick plainly follows what was used: what `_wins` finds of each, for all at once."""
        current = self._current
        if current is None or _first(ticks[0]) != current.sequence + 1:
            return False
        if not current.has(ticks[0], series) or not _follows(ticks):
            return False
        number = ticks["ticks"].astype(np.int64)[1:]
        duration = np.minimum(ticks["duration_ns"][1:], np.uint64(number.max(initial=1) * _LONGEST_NS)).astype(np.int64) // number
        line = number * duration
        apart = np.abs(ticks["end_time_ns"][1:] - ticks["end_time_ns"][:-1] - line)
        return bool(((duration <= _LONGEST_NS) & (apart <= duration // 2 + line // 8)).all())

    def _wins(self, tick: Any, series: int) -> bool:
        current = self._current
        if current is not None and current.has(tick, series):
            if _first(tick) <= current.sequence:
                self.dropped += 1
                return False
        elif any(run.has(tick, series) for run in self._before):
            self.dropped += 1
            return False
        elif current is not None:
            self._before = [current, *self._before][:_RUNS_BEFORE]
        self._current = _Run(series, int(tick["sequence"]), int(tick["end_time_ns"]))
        return True
