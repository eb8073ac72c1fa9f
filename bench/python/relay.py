#!/usr/bin/env python3
"""What a user would write today: a subscriber that corrects with one constant bias, scale and matrix, and publishes.

No temperatures, no gaps, no swaps. On `imu/{unit}/corrected` goes for each raw gyro batch: sequence number of its first tick
(u64), then six increments (f64) for each tick, little-endian. Says `{"ready": ...}` on stdout; ends where stdin does.
"""

import argparse
import json
import sys

import numpy
import zenoh

import raw


class Correction:
    """Constants as arrays."""

    def __init__(self, constants):
        for name, value in constants.items():
            setattr(self, name, numpy.array(value))

    def angles(self, readings, durations):
        return ((readings * self.gyro_weight - self.gyro_bias) * durations) @ self.gyro_axes.T

    def velocities(self, readings, durations):
        return ((readings - self.accel_bias) / self.accel_scale * durations) @ self.accel_axes.T


def open_session():
    """The project's own settings: a peer on loopback that finds nobody by itself."""
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "adminspace/enabled": True,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/queue/batching/time_limit": 0,
        "transport/link/tx/queue/size/real_time": 16,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def locators(session):
    """Where the session listens, with the port that the system has chosen: its admin space knows."""
    replies = session.get(f"@/{session.info.zid()}/peer")
    return [it for reply in replies for it in json.loads(reply.ok.payload.to_bytes())["locators"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--constants", required=True, metavar="FILE", help="biases, scales and axes, JSON")
    parser.add_argument("--block", action="store_true", help="wait for a slow subscriber")
    arguments = parser.parse_args()
    with open(arguments.constants, encoding="utf-8") as file:
        correction = Correction(json.load(file))
    congestion = zenoh.CongestionControl.BLOCK if arguments.block else zenoh.CongestionControl.DROP
    publishers, velocities = {}, {}

    with open_session() as session:

        def receive(sample):
            _, unit, _, topic = str(sample.key_expr).split("/")
            if topic == "temp":
                return
            kind = raw.GYRO if topic == "gyro" else raw.ACCEL
            first, _, durations, readings = raw.ticks(sample.payload.to_bytes(), kind)
            seconds = numpy.array(durations).reshape(-1, 1) * 1e-9
            if topic == "accel":
                velocities[unit] = (first, correction.velocities(numpy.array(readings), seconds))
                return
            angles = correction.angles(numpy.array(readings), seconds)
            of, velocity = velocities.get(unit, (None, None))
            if of != first:
                return
            publisher = publishers.get(unit)
            if publisher is None:
                publisher = publishers[unit] = session.declare_publisher(
                    f"imu/{unit}/corrected", congestion_control=congestion, priority=zenoh.Priority.REAL_TIME
                )
            publisher.put(first.to_bytes(8, "little") + numpy.hstack((angles, velocity)).tobytes())

        subscriber = session.declare_subscriber("imu/*/raw/*", receive)
        # Where it answers, the subscription is known. A query that is dropped has ended.
        answers = session.declare_queryable("imu/*/status", lambda query: None)
        print(json.dumps({"ready": True, "locators": locators(session)}), flush=True)
        sys.stdin.read()
        answers.undeclare()
        subscriber.undeclare()


if __name__ == "__main__":
    main()
