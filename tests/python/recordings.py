#!/usr/bin/env python3
"""Checks what `isotherm-replay convert` writes with programs of others: mcap, jsonschema, rosbags and duckdb.

    recordings.py FOLDER

FOLDER holds log.mcap and what was made of it: text/UNIT/{raw,corrected}.csv, the bag ros2 (with --raw) and
parquet/UNIT/STREAM.parquet; and documents.json with what the units' calibration documents say of raw readings: the
angle of a count (rad, null for means), the specific force of an accelerometer's reading (m/s2), and whether these are counts. The CSV files say what there must be; the recording, the bag and the tables must say the
same, to the last bit. Prints how much was compared as one JSON object. Exit codes: 0 all is equal, 1 something is not.
"""

import csv
import json
import math
import pathlib
import sys

import duckdb
import isotherm
import jsonschema
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

AXES = "xyz"
ACCELEROMETER_MISSING, UNCALIBRATED, ANGLE_INVALID, VELOCITY_INVALID = 1 << 2, 1 << 4, 1 << 10, 1 << 11


class Different(Exception):
    """Two values that must be equal are not."""


def same(what, got, expected):
    """NaN equals itself, -0.0 is not 0.0."""
    if isinstance(expected, float):
        alike = isinstance(got, float) and (got.hex() == expected.hex() or math.isnan(got) and math.isnan(expected))
    else:
        alike = got == expected
    if not alike:
        raise Different(f"{what}: got {got!r}, must be {expected!r}")


def same_rows(what, got, expected):
    same(f"{what}: number", len(got), len(expected))
    for number, (mine, right) in enumerate(zip(got, expected)):
        same(f"{what} {number}: fields", sorted(mine), sorted(right))
        for name in right:
            same(f"{what} {number}: {name}", mine[name], right[name])


def number(text):
    """A cell as the number that it is: whole or not."""
    try:
        return int(text)
    except ValueError:
        return float(text)


def cells(text):
    return [number(cell) for cell in text.split()]


def read_csv(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def readings(row, kind):
    names = [name for name in row if name.startswith(f"{kind}_") and name.rsplit("_", 1)[1].isdigit()]
    return [number(row[name]) for name in names]


def mode(text):
    return int(text) if text else None


class Unit:
    """What the CSV files say of a unit."""

    def __init__(self, folder):
        raw = read_csv(folder / "raw.csv")
        self.gyro = [
            {
                "sequence": int(row["gyro_sequence"]),
                "end_time_ns": int(row["end_time_ns"]),
                "duration_ns": int(row["gyro_duration_ns"]),
                "mode": mode(row.get("mode", "")),
                "switch_command": row.get("switch") == "1",
                "readings": readings(row, "gyro"),
            }
            for row in raw
            if row["gyro_sequence"]
        ]
        self.accel = [
            {
                "sequence": int(row["accel_sequence"]),
                "end_time_ns": int(row["end_time_ns"]),
                "duration_ns": int(row["accel_duration_ns"]),
                "readings": readings(row, "accel"),
            }
            for row in raw
            if row["accel_sequence"]
        ]
        self.temperature = sorted(
            (int(row["end_time_ns"]), name.removeprefix("temperature_"), float(row[name]))
            for row in raw
            for name in row
            if name.startswith("temperature_") and row[name]
        )
        self.corrected = [
            {
                "sequence": int(row["sequence"]),
                "end_time_ns": int(row["end_time_ns"]),
                "duration_ns": int(row["duration_ns"]),
                "ticks": int(row["ticks"]),
                "missed": int(row["missed"]),
                "delta_angle_rad": [float(row[f"delta_angle_{axis}_rad"]) for axis in AXES],
                "delta_velocity_m_per_s": [float(row[f"delta_velocity_{axis}_m_per_s"]) for axis in AXES],
                "mode": mode(row["mode"]),
                "flags": int(row["flags"]),
                "gyro_flags": cells(row["gyro_flags"]),
                "accel_flags": cells(row["accel_flags"]),
                "revision": int(row["revision"]),
            }
            for row in read_csv(folder / "corrected.csv")
        ]


def flat(tick):
    """A tick with its lists spread, so that every number is compared by itself."""
    out = {}
    for name, value in tick.items():
        if isinstance(value, list):
            out.update({f"{name}[{index}]": item for index, item in enumerate(value)})
        else:
            out[name] = value
    return out


def flats(ticks):
    return [flat(tick) for tick in ticks]


SIGNS = {None: None, "Plus": 1, "Minus": -1}
RAW_KINDS = {"gyro": isotherm.RAW_GYRO, "accel": isotherm.RAW_ACCEL, "temp": isotherm.RAW_TEMPERATURE}


class Views:
    """Channels that describe themselves: read by their JSON Schema alone, as viewers do."""

    def __init__(self):
        self.validators = {}
        self.topics = {}

    def take(self, schema, channel, message):
        same(f"{channel.topic}: schema's encoding", schema.encoding, "jsonschema")
        if schema.id not in self.validators:
            described = json.loads(schema.data)
            jsonschema.Draft202012Validator.check_schema(described)
            # A field that the schema does not name would be shown without its unit of measure.
            described["additionalProperties"] = False
            self.validators[schema.id] = jsonschema.Draft202012Validator(described)
        view = json.loads(message.data)
        self.validators[schema.id].validate(view)
        stamp = view["timestamp"]["sec"] * 10**9 + view["timestamp"]["nsec"]
        same(f"{channel.topic}: publish time", message.publish_time, stamp)
        self.topics.setdefault(channel.topic, []).append((stamp, message.log_time, view))

    def of(self, unit, topic):
        """What is shown of a topic, by the producer's clock."""
        return sorted(self.topics[f"imu/{unit}/{topic}/json"], key=lambda view: view[0])

    def check(self, units):
        for name, unit in units.items():
            views = self.of(name, "corrected")
            same(f"json: {name}: ticks", len(views), len(unit.corrected))
            for (stamp, _, view), tick in zip(views, unit.corrected):
                what, seconds = f"json: {name}: {tick['sequence']}", float(tick["duration_ns"]) * 1e-9
                same(f"{what}: end", stamp, tick["end_time_ns"])
                for field in ("sequence", "missed", "flags", "revision"):
                    same(f"{what}: {field}", view[field], tick[field])
                same(f"{what}: mode", view["mode"], tick["mode"] or 0)
                flags = tick["flags"]
                known = {
                    "angular_rate_deg_per_h": not flags & (UNCALIBRATED | ANGLE_INVALID),
                    "specific_force_m_per_s2": not flags & (UNCALIBRATED | ACCELEROMETER_MISSING | VELOCITY_INVALID),
                }
                deltas = {"angular_rate_deg_per_h": "delta_angle_rad", "specific_force_m_per_s2": "delta_velocity_m_per_s"}
                for field, is_known in known.items():
                    same(f"{what}: {field} is there", field in view, is_known)
                    if not is_known:
                        continue
                    for axis, delta in zip(AXES, tick[deltas[field]]):
                        right = delta / seconds
                        if field == "angular_rate_deg_per_h":
                            right = math.degrees(right) * 3600.0
                        same(f"{what}: {field}", math.isclose(view[field][axis], right, rel_tol=1e-12, abs_tol=1e-12), True)
            # Within a message ticks lie as far apart on the recorder's clock as on the producer's.
            apart = {late[1] - early[1] - (late[0] - early[0]) for early, late in zip(views, views[1:])}
            same(f"json: {name}: distances kept within messages", 0 in apart, True)
            for kind, ticks in (("gyro", unit.gyro), ("accel", unit.accel)):
                views = self.of(name, f"raw/{kind}")
                got = [(view["sequence"], view["readings"]) for _, _, view in views]
                same(f"json: {name}: raw {kind}", got, [(tick["sequence"], tick["readings"]) for tick in ticks])
            views = self.of(name, "raw/temp")
            got = sorted((stamp, *pair) for stamp, _, view in views for pair in view["raw"].items())
            same(f"json: {name}: temperatures", got, unit.temperature)


def check_mcap(path, units):
    """The recording by the mcap package, its frames by the package isotherm."""
    gyro, accel, temperature, corrected, status = ({unit: [] for unit in units} for _ in range(5))
    views = Views()
    with open(path, "rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        counted = 0
        for schema, channel, message in reader.iter_messages():
            counted += 1
            if channel.message_encoding == "json":
                views.take(schema, channel, message)
                continue
            same("encoding", channel.message_encoding, "isotherm")
            same("schema's encoding", schema.encoding, "isotherm-wire")
            _, unit, *topic = channel.topic.split("/")
            same("the channel's unit", channel.metadata["unit"], unit)
            if topic == ["corrected"]:
                batch = isotherm.decode(message.data, isotherm.CORRECTED)
                same("unit", batch["unit"], unit)
                same("publish time", message.publish_time, batch["ticks"][-1]["end_time_ns"])
                for tick in batch["ticks"]:
                    kept = {name: tick[name] for name in tick if not name.endswith(("_rad_per_s", "_m_per_s2"))}
                    kept["mode"] = SIGNS[tick["mode"]]
                    corrected[unit].append({**kept, "revision": batch["revision"]["counter"]})
            elif topic == ["status"]:
                status[unit].append(isotherm.decode(message.data, isotherm.STATUS))
            else:
                batch = isotherm.decode(message.data, RAW_KINDS[topic[1]])
                last = batch["ticks"][-1]
                same("publish time", message.publish_time, last.get("end_time_ns", last.get("time_ns")))
                if topic[1] == "temp":
                    for tick in batch["ticks"]:
                        pairs = zip(batch["channels"], tick["raw"])
                        temperature[unit] += [(tick["time_ns"], name, raw) for name, raw in pairs]
                    continue
                for index, tick in enumerate(batch["ticks"]):
                    (values,) = tick["readings"].values()
                    kept = {"sequence": batch["first_sequence"] + index, "readings": values}
                    kept |= {name: tick[name] for name in ("end_time_ns", "duration_ns")}
                    if topic[1] == "gyro":
                        kept |= {"mode": SIGNS[tick["mode"]], "switch_command": tick["switch_command"]}
                    (gyro if topic[1] == "gyro" else accel)[unit].append(kept)
        same("messages in the summary", summary.statistics.message_count, counted)
    views.check(units)
    for name, unit in units.items():
        same_rows(f"mcap: {name}: raw gyro", flats(gyro[name]), flats(unit.gyro))
        same_rows(f"mcap: {name}: raw accel", flats(accel[name]), flats(unit.accel))
        same_rows(f"mcap: {name}: corrected", flats(corrected[name]), flats(unit.corrected))
        same(f"mcap: {name}: temperatures", sorted(temperature[name]), unit.temperature)
        same(f"mcap: {name}: status messages", len(status[name]), 1)
    return counts(gyro, corrected, temperature)


def counts(gyro, corrected, temperature):
    total = lambda streams: sum(len(stream) for stream in streams.values())
    return {"raw_gyro": total(gyro), "corrected": total(corrected), "temperature": total(temperature)}


def vector(value):
    return [float(value.x), float(value.y), float(value.z)]


def check_imu(what, imu, time_ns, rate, force):
    """An Imu message against rates and forces; None is what it must not know."""
    same(f"{what}: stamp", imu.header.stamp.sec * 10**9 + imu.header.stamp.nanosec, time_ns)
    same(f"{what}: orientation", float(imu.orientation_covariance[0]), -1.0)
    for name, covariance, got, expected in [
        ("rate", imu.angular_velocity_covariance, imu.angular_velocity, rate),
        ("force", imu.linear_acceleration_covariance, imu.linear_acceleration, force),
    ]:
        same(f"{what}: covariance of {name}", [float(x) for x in covariance], [0.0 if expected else -1.0] + [0.0] * 8)
        for axis, mine, right in zip(AXES, vector(got), expected or [0.0] * 3):
            same(f"{what}: {name} {axis}", mine, right)


def check_ros2(path, units, documents):
    """The bag by the rosbags package: with its own types of ROS 2 Jazzy, and with the definitions in the bag."""
    names = {unit: unit.replace("-", "_") for unit in units}
    store = get_typestore(Stores.ROS2_JAZZY)
    own = get_typestore(Stores.EMPTY)
    data, raw, temperature = ({unit: [] for unit in units} for _ in range(3))
    with Reader(path) as reader:
        for connection in reader.connections:
            own.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            kind = connection.msgtype
            same(f"{kind}: hash of the definition", own.hash_rihs01(kind), store.hash_rihs01(kind))
            same(f"{connection.topic}: quality of service", len(connection.ext.offered_qos_profiles), 1)
        counted = 0
        for connection, time_ns, frame in reader.messages():
            counted += 1
            message = store.deserialize_cdr(frame, connection.msgtype)
            same("the bag's definition", own.deserialize_cdr(frame, connection.msgtype) is None, False)
            _, root, name, *topic = connection.topic.split("/")
            (unit,) = [unit for unit in names if names[unit] == name]
            same("topic", root, "imu")
            same("frame", message.header.frame_id, name)
            if topic == ["data"]:
                data[unit].append((time_ns, message))
            elif topic == ["data_raw"]:
                raw[unit].append((time_ns, message))
            else:
                same("stamp", message.header.stamp.sec * 10**9 + message.header.stamp.nanosec, time_ns)
                temperature[unit].append((topic[0], topic[1], time_ns, float(message.temperature)))
        same("messages in metadata.yaml", reader.message_count, counted)
        same("messages of the topics", sum(connection.msgcount for connection in reader.connections), counted)
    for name, unit in units.items():
        stated = [tick for tick in unit.corrected if not tick["flags"] & UNCALIBRATED]
        same(f"ros2: {name}: number", len(data[name]), len(stated))
        for (time_ns, imu), tick in zip(data[name], stated):
            what, seconds = f"ros2: {name}: {tick['sequence']}", float(tick["duration_ns"]) * 1e-9
            same(f"{what}: time", time_ns, tick["end_time_ns"])
            rate = [delta / seconds for delta in tick["delta_angle_rad"]]
            force = [delta / seconds for delta in tick["delta_velocity_m_per_s"]]
            flags = tick["flags"]
            no_force = flags & (ACCELEROMETER_MISSING | VELOCITY_INVALID)
            check_imu(what, imu, time_ns, None if flags & ANGLE_INVALID else rate, None if no_force else force)
        same(f"ros2: {name}: raw: number", len(raw[name]), len(unit.gyro))
        weights, scales, are_counts = documents[name]
        accel = {}
        for tick in unit.accel:
            seconds = float(tick["duration_ns"]) * 1e-9 if are_counts else 1.0
            accel[tick["end_time_ns"]] = [reading * scale / seconds for reading, scale in zip(tick["readings"], scales)]
        for (time_ns, imu), tick in zip(raw[name], unit.gyro):
            what, seconds = f"ros2: {name}: raw {tick['sequence']}", float(tick["duration_ns"]) * 1e-9
            same(f"{what}: time", time_ns, tick["end_time_ns"])
            rate = tick["readings"]
            if weights:
                rate = [weight * count / seconds for weight, count in zip(weights, rate)]
            check_imu(what, imu, time_ns, rate, accel.get(time_ns))
        same(f"ros2: {name}: applied temperatures", any(kind == "temperature" for kind, *_ in temperature[name]), True)
        given = sorted((time_ns, channel) for kind, channel, time_ns, _ in temperature[name] if kind == "temperature_raw")
        same(f"ros2: {name}: raw temperatures", given, [(time_ns, channel) for time_ns, channel, _ in unit.temperature])
    return counts(raw, data, temperature)


def table(path):
    connection = duckdb.connect()
    cursor = connection.execute("SELECT * FROM read_parquet(?)", [str(path)])
    names = [column[0] for column in cursor.description]
    return [dict(zip(names, row)) for row in cursor.fetchall()]


def spread(rows, names, lists):
    """Rows of a table as the CSV's ticks: `lists` gives the columns of each list."""
    out = []
    for row in rows:
        tick = {name: row[name] for name in names}
        for name, columns in lists.items():
            tick[name] = [row[column] for column in columns if row[column] is not None]
        out.append(flat(tick))
    return out


def check_parquet(folder, units):
    """The tables by duckdb."""
    gyro, corrected, temperature = {}, {}, {}
    for name, unit in units.items():
        place = folder / name
        rows = table(place / "raw_gyro.parquet")
        sensors = [column for column in rows[0] if column.startswith("sensor_") and "_half_" not in column]
        names = ["sequence", "end_time_ns", "duration_ns", "mode", "switch_command"]
        gyro[name] = spread(rows, names, {"readings": sensors})
        same_rows(f"parquet: {name}: raw gyro", gyro[name], flats(unit.gyro))
        rows = table(place / "raw_accel.parquet")
        sensors = [column for column in rows[0] if column.startswith("sensor_")]
        accel = spread(rows, names[:3], {"readings": sensors})
        same_rows(f"parquet: {name}: raw accel", accel, flats(unit.accel))
        rows = table(place / "raw_temperature.parquet")
        temperature[name] = sorted((row["time_ns"], row["channel"], row["raw"]) for row in rows)
        same(f"parquet: {name}: temperatures", temperature[name], unit.temperature)
        rows = table(place / "corrected.parquet")
        lists = {
            "delta_angle_rad": [f"delta_angle_{axis}_rad" for axis in AXES],
            "delta_velocity_m_per_s": [f"delta_velocity_{axis}_m_per_s" for axis in AXES],
            "gyro_flags": [column for column in rows[0] if column.startswith("gyro_") and column.endswith("_flags")],
            "accel_flags": [column for column in rows[0] if column.startswith("accel_") and column.endswith("_flags")],
        }
        names = ["sequence", "end_time_ns", "duration_ns", "ticks", "missed", "mode", "flags", "revision"]
        corrected[name] = spread(rows, names, lists)
        same_rows(f"parquet: {name}: corrected", corrected[name], flats(unit.corrected))
        (status,) = table(place / "status.parquet")
        same(f"parquet: {name}: status", json.loads(status["status"])["unit"], name)
        pairs = duckdb.connect().execute(
            "SELECT key, value FROM parquet_kv_metadata(?)", [str(place / "corrected.parquet")]
        )
        provenance = {bytes(key).decode(): bytes(value).decode() for key, value in pairs.fetchall()}
        same(f"parquet: {name}: provenance", (provenance["unit"], provenance["stream"]), (name, "corrected"))
    return counts(gyro, corrected, temperature)


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    folder = pathlib.Path(sys.argv[1])
    units = {place.name: Unit(place) for place in sorted((folder / "text").iterdir())}
    with open(folder / "documents.json", encoding="utf-8") as file:
        documents = json.load(file)
    gyro = {name: unit.gyro for name, unit in units.items()}
    corrected = {name: unit.corrected for name, unit in units.items()}
    temperature = {name: unit.temperature for name, unit in units.items()}
    try:
        said = {
            "csv": counts(gyro, corrected, temperature),
            "mcap": check_mcap(folder / "log.mcap", units),
            "ros2": check_ros2(folder / "ros2", units, documents),
            "parquet": check_parquet(folder / "parquet", units),
        }
    except Different as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    print(json.dumps(said))


if __name__ == "__main__":
    main()
