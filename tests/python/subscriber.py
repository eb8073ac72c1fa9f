#!/usr/bin/env python3
"""A subscriber of corrected increments in Python, and a check of docs/wire-vectors.txt.

    subscriber.py --connect tcp/127.0.0.1:7447              one JSON line per output, a summary at the end
    subscriber.py --connect ... --ticks 1000 --summary      stop after 1000 raw ticks, print the summary only
    subscriber.py --vectors docs/wire-vectors.txt           decode and encode the test vectors, no session

On stdout: a line {"ready": true} once no output can be missed any more, then the outputs, then the summary. It stops
after --ticks raw ticks (received or announced as missing, over all units) or after --idle seconds without a message.
Exit codes: 0 all is well, 1 a frame was refused, ticks are short of --ticks or a vector failed, 2 usage, 3 ticks were
lost or came twice.
"""

import argparse
import hashlib
import json
import math
import queue
import struct
import sys
import threading

import wire

RESTART = 1 << 8
SUMMED = ("delta_angle_rad", "delta_velocity_m_per_s")


class Account:
    """What is known of one unit: the continuity rule, sums and a digest of the increments."""

    def __init__(self):
        self.outputs = self.ticks = self.announced_missing = 0
        self.lost = self.duplicated = self.restarts = 0
        self.flags_seen = 0
        self.last = None
        self.revision = None
        self.sums = {name: [0.0, 0.0, 0.0] for name in SUMMED}
        self.digest = hashlib.sha256()

    def enter(self, batch):
        self.revision = batch["revision"]
        for tick in batch["ticks"]:
            self.follow(tick)
            self.outputs += 1
            self.ticks += tick["ticks"]
            self.announced_missing += tick["missed"]
            self.flags_seen |= tick["flags"]
            for name in SUMMED:
                self.sums[name] = [a + b for a, b in zip(self.sums[name], tick[name])]
            increments = tick["delta_angle_rad"] + tick["delta_velocity_m_per_s"]
            self.digest.update(struct.pack("<QqH6d", tick["sequence"], tick["end_time_ns"], tick["flags"], *increments))

    def follow(self, tick):
        """The continuity rule of docs/wire.md."""
        first = tick["sequence"] - (tick["ticks"] - 1)
        if self.last is not None and tick["flags"] & RESTART:
            self.restarts += 1
        elif self.last is not None:
            expected = self.last + 1 + tick["missed"]
            self.lost += max(0, first - expected)
            self.duplicated += max(0, expected - first)
        self.last = tick["sequence"]

    def summary(self):
        return {
            "outputs": self.outputs,
            "ticks": self.ticks,
            "announced_missing": self.announced_missing,
            "lost": self.lost,
            "duplicated": self.duplicated,
            "restarts": self.restarts,
            "last_sequence": self.last,
            "flags_seen": self.flags_seen,
            "revision": self.revision,
            "sums": self.sums,
            # The sums again, to the bit: binary64 in hexadecimal, three angles and three velocities.
            "sum_bits": [struct.pack(">d", x).hex() for name in SUMMED for x in self.sums[name]],
            # Over every output in order: sequence (u64), end_time_ns (i64), flags (u16), three angle and three
            # velocity increments (f64), all little-endian.
            "sha256": self.digest.hexdigest(),
        }


def open_session(endpoint):
    """A peer on loopback that finds nobody but `endpoint`."""
    import zenoh

    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("connect/timeout_ms", "10000")
    config.insert_json5("connect/exit_on_failure", "true")
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    return zenoh.open(config)


def wait_for_service(session, limit):
    """After the service has answered a query it knows of every subscription that was made before."""
    import zenoh

    querier = session.declare_querier(
        "imu/*/status",
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=limit,
    )
    matching = threading.Event()
    listener = querier.declare_matching_listener(lambda status: matching.set() if status.matching else None)
    if not querier.matching_status.matching and not matching.wait(limit):
        raise TimeoutError(f"no service answers on imu/*/status within {limit} s")
    for _ in querier.get():
        pass  # Status of the units that there are already; the end of the replies is the answer.
    listener.undeclare()
    querier.undeclare()


def say(message):
    print(json.dumps(message), flush=True)


def listen(arguments):
    """Receives until there is enough or nothing comes any more; the exit code."""
    messages = queue.Queue()
    accounts, rejected = {}, 0
    accounted = 0
    with open_session(arguments.connect) as session:
        # A service that stops asks whether everything has come; ending its query without a reply says so.
        receipt = session.declare_queryable(f"isotherm/{session.zid()}/receipt", lambda query: query.drop())
        # Zenoh's thread only hands the bytes over: a slow callback would hold up the session.
        subscriber = session.declare_subscriber(
            arguments.key, lambda sample: messages.put((str(sample.key_expr), sample.payload.to_bytes()))
        )
        wait_for_service(session, arguments.idle)
        say({"ready": True})
        while arguments.ticks is None or accounted < arguments.ticks:
            try:
                key, frame = messages.get(timeout=arguments.idle)
            except queue.Empty:
                break
            try:
                batch = wire.decode(frame, wire.CORRECTED)
                if key != f"imu/{batch['unit']}/corrected":
                    raise wire.Refused(f"unit {batch['unit']} on key {key}")
            except wire.Refused as error:
                rejected += 1
                print(f"{key}: {error}", file=sys.stderr)
                continue
            accounts.setdefault(batch["unit"], Account()).enter(batch)
            accounted += sum(tick["ticks"] + tick["missed"] for tick in batch["ticks"])
            if not arguments.summary:
                for tick in batch["ticks"]:
                    say({"unit": batch["unit"], "revision": batch["revision"]["counter"], **tick})
        receipt.undeclare()
        subscriber.undeclare()
    say({"units": {unit: account.summary() for unit, account in accounts.items()}, "rejected": rejected})
    if any(account.lost or account.duplicated for account in accounts.values()):
        return 3
    return 1 if rejected or accounted < (arguments.ticks or 0) else 0


def without_nan(value):
    """JSON has no NaN; the vectors have null."""
    if isinstance(value, dict):
        return {name: without_nan(item) for name, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def read_vectors(path):
    """The good frames (name, frame, JSON) and those to be refused (name, kind, frame) of the file of vectors."""
    good, refused = [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            if not line.strip() or line.startswith("#"):
                continue
            directive, _, rest = line.rstrip("\n").partition(" ")
            if directive == "vector":
                vector = {"name": rest, "frame": b"", "json": ""}
                good.append(vector)
            elif directive == "refuse":
                name, kind = rest.split()
                vector = {"name": name, "kind": int(kind), "frame": b""}
                refused.append(vector)
            elif directive == "hex":
                vector["frame"] += bytes.fromhex(rest.partition("#")[0])
            elif directive == "json":
                vector["json"] += rest + "\n"
            else:
                raise ValueError(f"{path}: no directive: {line}")
    return good, refused


def check_vectors(path):
    """Decodes and encodes every vector of the file; the exit code."""
    good, refused = read_vectors(path)
    failures = []
    for vector in good:
        name, frame = vector["name"], vector["frame"]
        try:
            message = wire.decode(frame, frame[0])
        except wire.Refused as error:
            failures.append(f"{name}: refused: {error}")
            continue
        if without_nan(message) != json.loads(vector["json"]):
            failures.append(f"{name}: decoded to {json.dumps(without_nan(message))}")
        encoded = wire.encode(message, frame[0], version=frame[1])
        if encoded != frame:
            failures.append(f"{name}: encoded to {encoded.hex(' ')}")
    for vector in refused:
        try:
            wire.decode(vector["frame"], vector["kind"])
            failures.append(f"{vector['name']}: accepted, must be refused")
        except wire.Refused:
            pass
    if not good or not refused:
        failures.append(f"{path} has no vectors")
    for failure in failures:
        print(failure, file=sys.stderr)
    say({"vectors": len(good), "refused": len(refused), "failures": len(failures)})
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--connect", metavar="ENDPOINT", help="endpoint of the service or a router")
    what.add_argument("--vectors", metavar="FILE", help="check the vectors of docs/wire-vectors.txt and stop")
    parser.add_argument("--key", default="imu/*/corrected", help="key to subscribe to (default: %(default)s)")
    parser.add_argument("--ticks", type=int, metavar="N", help="stop after N raw ticks")
    parser.add_argument("--idle", type=float, default=10.0, metavar="S", help="stop after S s of silence (default: 10)")
    parser.add_argument("--summary", action="store_true", help="print the summary only")
    arguments = parser.parse_args()
    sys.exit(check_vectors(arguments.vectors) if arguments.vectors else listen(arguments))


if __name__ == "__main__":
    main()
