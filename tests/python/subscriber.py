#!/usr/bin/env python3
"""A subscriber made with the package `isotherm`, whose account a test compares with that of a Rust consumer, to the bit.

    subscriber.py ENDPOINT TICKS SILENCE_S

On stdout: a line {"ready": true} once no output can be missed any more, and a summary after TICKS raw ticks (received or announced
as missing, over all units) or SILENCE_S seconds without a message. Exit codes: 0 all is well, 1 ticks are short or a frame was
refused.
"""

import hashlib
import json
import struct
import sys

import isotherm

SUMMED = ("delta_angle_rad", "delta_velocity_m_per_s")


class Sums:
    """What is known of one unit beside its account: sums and a digest of the increments."""

    def __init__(self):
        self.outputs = self.flags_seen = 0
        self.revision = None
        self.sums = [0.0] * 6
        self.digest = hashlib.sha256()

    def enter(self, batch):
        self.revision = {"counter": batch.revision, "digest": batch.digest}
        for tick in batch.ticks:
            self.outputs += 1
            self.flags_seen |= int(tick["flags"])
            increments = [float(value) for name in SUMMED for value in tick[name]]
            self.sums = [total + value for total, value in zip(self.sums, increments)]
            self.digest.update(struct.pack("<QqH6d", tick["sequence"], tick["end_time_ns"], tick["flags"], *increments))

    def summary(self, account):
        return {
            "outputs": self.outputs,
            "ticks": account.ticks,
            "announced_missing": account.announced_missing,
            "lost": account.lost,
            "duplicated": account.duplicated,
            "restarts": account.restarts,
            "last_sequence": account.last_sequence,
            "flags_seen": self.flags_seen,
            "revision": self.revision,
            # To the bit: binary64 in hexadecimal, three angles and three velocities.
            "sum_bits": [struct.pack(">d", value).hex() for value in self.sums],
            # Over every output in order: sequence (u64), end_time_ns (i64), flags (u16), three angle and three velocity
            # increments (f64), all little-endian.
            "sha256": self.digest.hexdigest(),
        }


def main():
    endpoint, ticks, silence_s = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    units, accounted = {}, 0
    with isotherm.connect(endpoint) as bus:
        stream = bus.corrected("*", first_wins=False)
        print(json.dumps({"ready": True}), flush=True)
        while accounted < ticks and (batch := stream.take(silence_s)) is not None:
            units.setdefault(batch.unit, Sums()).enter(batch)
            accounted += int(batch.ticks["ticks"].sum()) + int(batch.ticks["missed"].sum())
        summaries = {unit: sums.summary(stream.accounts[unit]) for unit, sums in units.items()}
        print(json.dumps({"units": summaries, "rejected": stream.refused}), flush=True)
        sys.exit(accounted < ticks or stream.refused > 0)


if __name__ == "__main__":
    main()
