"""Continuity, and the arbitration of two services (docs/wire.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import Array
from ._layout import TICK_FLAGS

_RESTART = TICK_FLAGS["RESTART"]
_MOST = (1 << 64) - 1
_RUNS_BEFORE = 3
# Outputs that a service may lag behind; with RESTART, beyond fewer a producer counts from the beginning again.
_MOST_BEHIND = 8192
_MOST_BEHIND_RESTART = 512


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
            self.lost = min(_MOST, self.lost + max(0, first - expected))
            self.duplicated = min(_MOST, self.duplicated + max(0, expected - first))
        self.ticks += max(1, int(tick["ticks"]))
        self.announced_missing = min(_MOST, self.announced_missing + missed)
        self.last_sequence, self.last_series = int(tick["sequence"]), series


@dataclass
class _Run:
    """What was used of a run of the producer."""

    series: int
    #: The highest number.
    sequence: int
    #: The latest end: the clock may have stepped back since.
    end_time_ns: int


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
        if run is None or len(ticks) == 0 or series != run.series or _first(ticks[0]) > run.sequence:
            return 0
        if max(int(ticks["sequence"].max()), run.sequence) >= 1 << 62:
            return 0
        sequence, number = ticks["sequence"].astype(np.int64), np.maximum(ticks["ticks"], 1).astype(np.int64)
        most = np.where(ticks["flags"] & _RESTART, _MOST_BEHIND_RESTART, _MOST_BEHIND)
        used = (sequence - (number - 1) <= run.sequence) & (np.maximum(run.sequence - sequence, 0) // number < most)
        used &= (ticks["end_time_ns"] <= run.end_time_ns) | (sequence > run.sequence)
        return len(ticks) if used.all() else int(used.argmin())

    def _goes_on(self, ticks: Array, series: int) -> bool:
        """Whether every tick plainly follows what was used: what `_wins` finds of each, for all at once."""
        current = self._current
        if current is None or series != current.series or _first(ticks[0]) != current.sequence + 1 or not _follows(ticks):
            return False
        end = ticks["end_time_ns"]
        return int(end[0]) > current.end_time_ns and bool((end[1:] > end[:-1]).all())

    def _wins(self, tick: Any, series: int) -> bool:
        sequence, end, number = int(tick["sequence"]), int(tick["end_time_ns"]), max(1, int(tick["ticks"]))
        first, restarts = _first(tick), bool(int(tick["flags"]) & _RESTART)
        most = _MOST_BEHIND_RESTART if restarts else _MOST_BEHIND

        def is_near(distance: int) -> bool:
            return distance // number < most

        current = self._current
        if current is not None and current.series != series:
            current = None
        goes_on = current is not None and first > current.sequence and is_near(first - current.sequence)

        def is_of(run: _Run) -> bool:
            if first > run.sequence:
                # The end of a run, which the other service's message lost.
                return current is None and not restarts and is_near(first - run.sequence)
            back = max(0, run.sequence - sequence)
            # Numbers and time began again: the present run comes past this one's.
            passes = current is not None and goes_on and end > current.end_time_ns and first - current.sequence - 1 <= back
            return end <= run.end_time_ns and is_near(back) and not passes

        used = current is not None and first <= current.sequence and is_near(max(0, current.sequence - sequence))
        used = used and current is not None and (end <= current.end_time_ns or sequence > current.sequence)
        if used or any(run.series == series and is_of(run) for run in self._before):
            self.dropped += 1
            return False
        if current is not None and goes_on:
            self._current = _Run(series, sequence, max(end, current.end_time_ns))
            return True
        if self._current is not None:
            self._before = [self._current, *self._before][:_RUNS_BEFORE]
        self._current = _Run(series, sequence, end)
        return True
