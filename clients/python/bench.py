#!/usr/bin/env python3
"""Ticks decoded per second in batches of 32, by the package and by the loop that one would write from docs/wire.md.

    bench.py [SECONDS]          one JSON object
    bench.py --frame            the first frame on stdout, for clients/c/bench.c

The frames are of the form that the service sends: three gyros, three accelerometers, eight channels. What both decode is compared
first. One core, processor time; the median of five rounds.
"""

from __future__ import annotations

import json
import math
import statistics
import struct
import sys
import time
import zlib
from typing import Any, Callable

import isotherm
import numpy as np

BATCH, FRAMES = 32, 200


def frames() -> list[bytes]:
    """Batches of consecutive ticks at 200 Hz, with digits as they come."""
    made = []
    for batch in range(FRAMES):
        ticks = []
        for k in range(batch * BATCH, (batch + 1) * BATCH):
            waves = [math.sin(k / period) for period in (7, 11, 13, 17, 19, 23)]
            ticks.append(
                {
                    "sequence": 1_000_000 + k,
                    "end_time_ns": 5_000_000_000_000 + 5_000_000 * k + int(1000 * waves[0]),
                    "duration_ns": 5_000_000 + int(1000 * waves[1]),
                    "ticks": 1,
                    "missed": 0,
                    "delta_angle_rad": [1e-4 * wave for wave in waves[:3]],
                    "delta_velocity_m_per_s": [0.05 * wave for wave in waves[3:]],
                    "mode": "Plus" if k // 300 % 2 == 0 else "Minus",
                    "flags": 1 if k % 300 < 20 else 0,
                    "gyro_flags": [1, 1, 1],
                    "accel_flags": [1, 1, 1],
                    "gyro_parity_rad_per_s": [],
                    "accel_parity_m_per_s2": [],
                }
            )
        temperatures = [{"channel": f"channel_{n}", "temperature_deg_c": 20.0 + n, "rate_deg_c_per_s": 1e-3} for n in range(8)]
        revision = {"counter": 3, "digest": "0123456789abcdef"}
        message = {"unit": "ZLG-0001", "revision": revision, "temperatures": temperatures, "ticks": ticks}
        made.append(isotherm.encode(message, isotherm.CORRECTED))
    return made


def naive(frame: bytes) -> list[tuple[Any, ...]]:
    """The loop that a user would write: one value after the other."""
    if zlib.crc32(frame[:-4]) != int.from_bytes(frame[-4:], "little") or frame[0] != 4 or frame[1] != 1:
        raise ValueError("no corrected batch")
    at = 2

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            byte = frame[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
            shift += 7

    def doubles(count: int) -> tuple[float, ...]:
        nonlocal at
        values = struct.unpack_from(f"<{count}d", frame, at)
        at += 8 * count
        return values

    length = varint()
    at += length
    varint()
    at += 8
    for _ in range(varint()):
        length = varint()
        at += length
        doubles(2)
    ticks = []
    for _ in range(varint()):
        sequence, end = varint(), varint()
        end = (end >> 1) ^ -(end & 1)
        duration, number, missed = varint(), varint(), varint()
        angles, velocities = doubles(3), doubles(3)
        mode = None
        present = frame[at]
        at += 1
        if present:
            mode = varint()
        flags = varint()
        sensors = []
        for _ in range(2):
            count = varint()
            sensors.append(list(frame[at : at + count]))
            at += count
        parities = [doubles(varint()) for _ in range(2)]
        ticks.append((sequence, end, duration, number, missed, angles, velocities, mode, flags, sensors, parities))
    return ticks


def ticks_per_s(decode: Callable[[bytes], Any], made: list[bytes], seconds: float) -> float:
    """The median of five rounds."""
    rates = []
    for _ in range(5):
        count, start = 0, time.process_time()
        while time.process_time() - start < seconds / 5:
            for frame in made:
                decode(frame)
            count += BATCH * len(made)
        rates.append(count / (time.process_time() - start))
    return statistics.median(rates)


def main() -> None:
    made = frames()
    if sys.argv[1:] == ["--frame"]:
        sys.stdout.buffer.write(made[0])
        return
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    decoder = isotherm.CorrectedDecoder()
    for frame in made:
        ticks, plain = decoder.decode(frame).ticks, naive(frame)
        assert ticks["sequence"].tolist() == [tick[0] for tick in plain]
        assert ticks["end_time_ns"].tolist() == [tick[1] for tick in plain]
        assert ticks["duration_ns"].tolist() == [tick[2] for tick in plain]
        assert np.array_equal(ticks["delta_angle_rad"], [tick[5] for tick in plain])
        assert np.array_equal(ticks["delta_velocity_m_per_s"], [tick[6] for tick in plain])
        assert ticks["mode"].tolist() == [{None: 0, 0: 1, 1: -1}[tick[7]] for tick in plain]
        assert ticks["flags"].tolist() == [tick[8] for tick in plain]
        assert ticks["gyro_flags"][:, :3].tolist() == [tick[9][0] for tick in plain]

    arbiter, account = isotherm.FirstWins(), isotherm.Account()

    def whole(frame: bytes) -> None:
        # As a stream does it; the frames come around again as a run of their own.
        nonlocal arbiter
        if frame is made[0]:
            arbiter = isotherm.FirstWins()
        batch = decoder.decode(frame)
        account.enter(arbiter.choose(batch.ticks, batch.series), batch.series)

    figures = {
        "ticks_per_s": round(ticks_per_s(decoder.decode, made, seconds)),
        "with_account_and_arbitration": round(ticks_per_s(whole, made, seconds)),
        "naive_loop": round(ticks_per_s(naive, made, seconds)),
        "batch": BATCH,
        "bytes_per_tick": round(sum(map(len, made)) / (BATCH * len(made)), 1),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
