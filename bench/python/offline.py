#!/usr/bin/env python3
"""A recording corrected with numpy, by the document's formulas: tick by tick, and vectorised over the log.

Constants, thermal polynomials and orientation of a micromechanical unit's document, temperatures smoothed and ramped as docs/model.md
states; no gaps, no spikes, no swaps, no flags. Prints one line of JSON: processor seconds of reading and of either way,
and how far the increments are from those in --corrected, as a share of the largest.
"""

import argparse
import json
import math
import os
import time
import tomllib

# One core, as what it is compared with.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy
from mcap.reader import make_reader

import raw

ARCSEC = math.pi / 180 / 3600
DELAY_S = 0.050
INCREMENTS = [f"delta_angle_{axis}_rad" for axis in "xyz"] + [f"delta_velocity_{axis}_m_per_s" for axis in "xyz"]


def read(path, unit):
    """Sequence-ordered arrays: end times (s) and durations (s), readings of gyros and of accelerometers; temperatures by channel."""
    ends, durations, gyros, accels, temperatures = [], [], [], [], {}
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            topic = channel.topic.removeprefix(f"imu/{unit}/raw/")
            if topic == "gyro":
                _, end, duration, readings = raw.ticks(message.data, raw.GYRO)
                ends += end
                durations += duration
                gyros += readings
            elif topic == "accel":
                accels += raw.ticks(message.data, raw.ACCEL)[3]
            elif topic == "temp":
                names, rows = raw.temperatures(message.data)
                for at, row in rows:
                    for name, value in zip(names, row):
                        temperatures.setdefault(name, []).append((at * 1e-9, value))
    seconds = numpy.array(ends) * 1e-9, numpy.array(durations) * 1e-9
    return *seconds, numpy.array(gyros), numpy.array(accels), {name: numpy.array(rows) for name, rows in temperatures.items()}


def polynomial(curve, key, temperature):
    """A curve of the document, held outside its range."""
    argument = numpy.clip(temperature, *curve["range_deg_c"]) - curve["reference_deg_c"]
    return numpy.polynomial.polynomial.polyval(argument, curve[key])


class Terms:
    """Everything that follows temperature, in one row for each reading: where the terms are heading, and from when on."""

    def __init__(self, document, temperatures):
        self.document = document
        smoothing = round(document["temperature"]["filter"]["smoothing_s"] / document["temperature"]["filter"]["grid_step_s"])
        smoothed = {}
        for channel in document["temperature"]["channel"]:
            rows = temperatures[channel["name"]]
            celsius = numpy.polynomial.polynomial.polyval(rows[:, 1], channel["conversion_deg_c"])
            # As if it had always been what it was first.
            padded = numpy.concatenate((numpy.full(smoothing - 1, celsius[0]), celsius))
            smoothed[channel["name"]] = sum(padded[i : i + len(celsius)] for i in range(smoothing)) / smoothing
            self.times = rows[:, 0]
        assumed = document["temperature"]["assumed_deg_c"]
        rows = self.evaluate(smoothed)
        before = self.evaluate({name: numpy.array([assumed]) for name in smoothed})
        # Terms move from one row to the next over a second; the first is met at once.
        self.heading = numpy.vstack((before, rows[:1], rows))
        self.starts = numpy.concatenate((self.times + DELAY_S, [math.inf]))

    def evaluate(self, celsius):
        """Weight, bias, 1/scale factor and bias of three sensors each, and both inverse orientations: 30 columns."""
        gyro, accel = self.document["gyro"], self.document["accel"]
        columns = []
        for sensor in gyro["sensor"]:
            at = celsius[sensor["channel"]]
            error = polynomial(sensor["increment_weight_error"], "coefficients_ppm", at) * 1e-6
            columns.append(sensor["increment_weight_rad_per_rad"] * (1 + error))
        for sensor in gyro["sensor"]:
            columns.append(polynomial(sensor["static_bias"], "coefficients_deg_per_h", celsius[sensor["channel"]]) * ARCSEC)
        for sensor in accel["sensor"]:
            scale = polynomial(sensor["scale_factor"], "coefficients_m_per_s2_per_m_per_s2", celsius[sensor["channel"]])
            columns.append(1 / scale)
        for sensor in accel["sensor"]:
            columns.append(polynomial(sensor["bias"], "coefficients_m_per_s2", celsius[sensor["channel"]]))
        for kind in (gyro, accel):
            columns += list(self.inverse(kind["orientation"], celsius).reshape(-1, 9).T)
        return numpy.stack(columns, axis=1)

    @staticmethod
    def inverse(orientation, celsius):
        thermal = orientation["thermal"]
        rows = numpy.array(orientation["rows"])
        rows /= numpy.linalg.norm(rows, axis=1, keepdims=True)
        mean = sum(celsius[name] for name in thermal["channels"]) / len(thermal["channels"])
        excess = numpy.clip(mean, *thermal["range_deg_c"]) - thermal["reference_deg_c"]
        return numpy.linalg.inv(rows + excess[:, None, None] * numpy.array(thermal["slopes_arcsec_per_deg_c"]) * ARCSEC)

    def step(self):
        return self.times[1] - self.times[0] if len(self.times) > 1 else 1.0


def vectorised(terms, ends, durations, gyros, accels):
    """Increments of all ticks at once."""
    place = numpy.searchsorted(terms.starts, ends)
    since = ends - terms.starts[numpy.maximum(place - 1, 0)]
    share = numpy.where(place > 1, numpy.clip(since / terms.step(), 0, 1), 1.0)[:, None]
    # Row `place + 1` is where the terms are heading, the one before is where they were.
    row = numpy.where(place > 0, place + 1, 0)
    first = terms.heading[numpy.maximum(row - 1, 0)]
    now = first + (terms.heading[row] - first) * share
    duration = durations[:, None]
    angles = (now[:, 0:3] * gyros - now[:, 3:6]) * duration
    velocities = (accels - now[:, 9:12]) * now[:, 6:9] * duration
    turned = numpy.einsum("nij,nj->ni", now[:, 12:21].reshape(-1, 3, 3), angles)
    return numpy.hstack((turned, numpy.einsum("nij,nj->ni", now[:, 21:30].reshape(-1, 3, 3), velocities)))


def tick_by_tick(terms, ends, durations, gyros, accels):
    """The same, as it is written first."""
    increments = numpy.empty((len(ends), 6))
    place = 0
    for k in range(len(ends)):
        while terms.starts[place] < ends[k]:
            place += 1
        if place == 0:
            now = terms.heading[0]
        else:
            share = min(max((ends[k] - terms.starts[place - 1]) / terms.step(), 0), 1) if place > 1 else 1.0
            now = terms.heading[place] + (terms.heading[place + 1] - terms.heading[place]) * share
        angle = (now[0:3] * gyros[k] - now[3:6]) * durations[k]
        velocity = (accels[k] - now[9:12]) * now[6:9] * durations[k]
        increments[k, 0:3] = now[12:21].reshape(3, 3) @ angle
        increments[k, 3:6] = now[21:30].reshape(3, 3) @ velocity
    return increments


def difference(increments, path):
    """Largest difference from corrected ticks in a CSV file, as a share of the largest increment of its kind."""
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    columns = [names.index(name) for name in INCREMENTS]
    expected = numpy.loadtxt(path, delimiter=",", skiprows=1, usecols=columns, max_rows=len(increments))
    shares = []
    for kind in (slice(0, 3), slice(3, 6)):
        shares.append(numpy.abs(increments[: len(expected), kind] - expected[:, kind]).max() / numpy.abs(expected[:, kind]).max())
    return max(shares)


def timed(work, *arguments):
    begin = time.process_time()
    result = work(*arguments)
    return result, time.process_time() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", required=True, metavar="MCAP")
    parser.add_argument("--document", required=True, metavar="TOML")
    parser.add_argument("--corrected", metavar="CSV", help="what the increments are compared with")
    parser.add_argument("--most", type=int, default=50_000, metavar="N", help="ticks that are corrected one by one (default: %(default)s)")
    arguments = parser.parse_args()
    with open(arguments.document, "rb") as file:
        document = tomllib.load(file)
    (*ticks, temperatures), read_s = timed(read, arguments.recording, document["unit"])
    terms, terms_s = timed(Terms, document, temperatures)
    all_at_once, vectorised_s = timed(vectorised, terms, *ticks)
    few = [column[: arguments.most] for column in ticks]
    one_by_one, tick_by_tick_s = timed(tick_by_tick, terms, *few)
    report = {
        "ticks": len(all_at_once),
        "read_s": read_s,
        "vectorised_s": terms_s + vectorised_s,
        "ticks_one_by_one": len(one_by_one),
        "tick_by_tick_s": tick_by_tick_s,
        "largest_difference": 0.0,
    }
    if arguments.corrected:
        both = difference(all_at_once, arguments.corrected), difference(one_by_one, arguments.corrected)
        report["largest_difference"] = float(max(both))
    print(json.dumps(report), flush=True)


if __name__ == "__main__":
    main()
