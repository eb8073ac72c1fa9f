"""ROS 2 as others implement it, against `isotherm-ros`.

Frozen vectors first: keys and tokens by zenoh-ros2-sdk, hashes of types and CDR by rosbags, names of publishers by xxhash. Then a
node made of these talks to the program: Imu and Temperature in, corrected Imu and diagnostics out, the services, the graph.

Usage: ros2.py VECTORS [PROGRAM MAPPING CALIBRATIONS]; without a program the vectors alone.
"""

import importlib.util
import json
import pathlib
import queue
import struct
import subprocess
import sys
import tempfile
import time
import types
import unittest

import numpy
import xxhash
import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

LIMIT = 30
TICK_NS = 10_000_000
START_NS = 1_700_000_000_000_000_000
DISTRIBUTIONS = [Stores.ROS2_JAZZY, Stores.ROS2_KILTED]


def sdk(name):
    """A module of zenoh-ros2-sdk without the rest of the package, which clones message definitions with git."""
    if "zenoh_ros2_sdk" not in sys.modules:
        package = types.ModuleType("zenoh_ros2_sdk")
        found = importlib.util.find_spec("rosbags").submodule_search_locations[0]
        package.__path__ = [str(pathlib.Path(found).parent / "zenoh_ros2_sdk")]
        sys.modules["zenoh_ros2_sdk"] = package
    return importlib.import_module(f"zenoh_ros2_sdk.{name}")


keyexpr, entity, attachment = sdk("keyexpr"), sdk("entity"), sdk("attachment")


def store(distribution):
    made = get_typestore(distribution)
    if "std_srvs/msg/Trigger_Response" not in made.types:
        made.register(get_types_from_msg("bool success\nstring message\n", "std_srvs/msg/Trigger_Response"))
        made.register(get_types_from_msg("uint8 structure_needs_at_least_one_member\n", "std_srvs/msg/Trigger_Request"))
    return made


STORE = store(DISTRIBUTIONS[0])


def gid(token):
    """XXH3-128, low half first: what rmw_zenoh does with a token."""
    value = xxhash.xxh3_128_intdigest(token.encode())
    return struct.pack("<QQ", value & (2**64 - 1), value >> 64)


def build(name, value):
    """A message of a type from what JSON has of it."""
    if isinstance(value, dict):
        kind = STORE.types[name]
        fields = dict(STORE.get_msgdef(name).fields)
        return kind(**{key: build_field(fields[key], it) for key, it in value.items()})
    return value


def build_field(field, value):
    node, inner = field
    if node == 2:  # a type by its name
        return build(inner, value)
    if node in (3, 4):  # an array, a sequence
        (kind, name), _ = inner
        if kind == 2:
            return [build(name, it) for it in value]
        return numpy.array(value, dtype=numpy.float64)
    return value


def ros_type(name):
    return name.replace("/srv/", "/msg/")


def own_node(session, domain=0, name="peer"):
    return entity.NodeEntity(domain, str(session.info.zid()), 0, name, "/")


class Vectors(unittest.TestCase):
    def setUp(self):
        self.vectors = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))

    def test_keys_and_tokens(self):
        for it in self.vectors["nodes"]:
            node = entity.NodeEntity(it["domain"], it["session"], 0, it["name"], it["namespace"])
            self.assertEqual(keyexpr.node_liveliness_keyexpr(node), it["token"])
            for of in it["endpoints"]:
                kind = entity.EntityKind[of["kind"]]
                endpoint = entity.EndpointEntity(node, of["number"], kind, of["topic"], of["dds"], of["hash"], of["qos"])
                self.assertEqual(keyexpr.endpoint_liveliness_keyexpr(endpoint), of["token"])
                self.assertEqual(keyexpr.topic_keyexpr(it["domain"], of["topic"], of["dds"], of["hash"]), of["key"])
                self.assertEqual(gid(of["token"]).hex(), of["gid"])

    def test_qualities_of_service(self):
        qos = sdk("qos")
        for it in self.vectors["nodes"][0]["endpoints"]:
            read = qos.QosProfile.decode(it["qos"])
            self.assertEqual(read.reliability.name, "BEST_EFFORT" if it["qos"].startswith("2") else "RELIABLE", it)
            self.assertEqual(read.durability.name, "VOLATILE", it)

    def test_hashes_of_types(self):
        names = {of["type"]: of["hash"] for it in self.vectors["nodes"] for of in it["endpoints"]}
        trigger = sdk("utils").compute_service_type_hash("std_srvs/srv/Trigger", "# empty", "bool success\nstring message")
        self.assertEqual(names.pop("std_srvs/srv/Trigger"), trigger)
        for distribution in DISTRIBUTIONS:
            made = get_typestore(distribution)
            for name, stated in names.items():
                self.assertEqual(made.hash_rihs01(name), stated, (distribution, name))

    def test_attachments(self):
        for it in self.vectors["attachments"]:
            of = attachment.Attachment(it["sequence"], it["time_ns"], bytes.fromhex(it["gid"]))
            self.assertEqual(of.to_bytes().hex(), it["bytes"])

    def test_payloads(self):
        for it in self.vectors["payloads"]:
            name = ros_type(it["type"])
            self.assertEqual(bytes(STORE.serialize_cdr(build(name, it["message"]), name)).hex(), it["cdr"], name)


class Node:
    """A node of ROS 2, on a session of its own."""

    def __init__(self, locator):
        config = zenoh.Config()
        for key, value in {
            "mode": "peer",
            "connect/endpoints": [locator],
            "listen/endpoints": ["tcp/127.0.0.1:0"],
            "scouting/multicast/enabled": False,
            "timestamping/enabled": True,
        }.items():
            config.insert_json5(key, json.dumps(value))
        self.session = zenoh.open(config)
        self.node = own_node(self.session)
        self.numbers, self.kept = 0, []
        self.token(keyexpr.node_liveliness_keyexpr(self.node))

    def token(self, token):
        self.kept.append(self.session.liveliness().declare_token(token))
        return token

    def endpoint(self, kind, topic, name):
        self.numbers += 1
        package, part, kind_name = name.split("/")
        dds, hashed = f"{package}::{part}::dds_::{kind_name}_", HASHES[name]
        of = entity.EndpointEntity(self.node, self.numbers, kind, topic, dds, hashed, "1:2:1,10:,:,:,,")
        return keyexpr.topic_keyexpr(0, topic, dds, hashed), self.token(keyexpr.endpoint_liveliness_keyexpr(of))

    def publisher(self, topic, name):
        key, token = self.endpoint(entity.EntityKind.PUBLISHER, topic, name)
        publisher = self.session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
        self.kept.append(publisher)
        wait(lambda: publisher.matching_status.matching, f"a subscriber of {topic}")
        numbers = iter(range(1, 2**31))

        def publish(message):
            with_it = attachment.Attachment(next(numbers), time.time_ns(), gid(token)).to_bytes()
            publisher.put(bytes(STORE.serialize_cdr(message, name)), attachment=with_it)

        return publish

    def subscription(self, topic, name):
        key, _ = self.endpoint(entity.EntityKind.SUBSCRIPTION, topic, name)
        heard = queue.Queue()
        self.kept.append(self.session.declare_subscriber(key, heard.put))
        return heard

    def call(self, topic, name="std_srvs/srv/Trigger"):
        key, token = self.endpoint(entity.EntityKind.CLIENT, topic, name)
        request = bytes.fromhex("0001000000")
        sent = attachment.Attachment(1, time.time_ns(), gid(token))
        replies = self.session.get(
            key,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            payload=request,
            attachment=sent.to_bytes(),
            timeout=LIMIT,
        )
        (reply,) = list(replies)
        back = attachment.Attachment.from_bytes(reply.ok.attachment.to_bytes())
        assert (back.sequence_id, back.gid) == (1, sent.gid), "a client knows by these what is answered"
        return STORE.deserialize_cdr(reply.ok.payload.to_bytes(), "std_srvs/msg/Trigger_Response")


def wait(holds, what):
    deadline = time.monotonic() + LIMIT
    while not holds():
        if time.monotonic() > deadline:
            raise AssertionError(f"no {what} within {LIMIT} s")
        time.sleep(0.01)


HASHES = {}


class Live(unittest.TestCase):
    """The program itself, with the correction in its own process."""

    def setUp(self):
        if len(sys.argv) < 5:
            self.skipTest("no program given")
        vectors = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))
        HASHES.update({of["type"]: of["hash"] for it in vectors["nodes"] for of in it["endpoints"]})
        program, mapping, calibrations = sys.argv[2:5]
        command = [program, "bridge", mapping, "--calibration", calibrations, "--listen", "127.0.0.1:0", "--announce", "--json"]
        self.log = tempfile.NamedTemporaryFile("w+", encoding="utf-8")
        self.addCleanup(self.log.close)
        self.program = subprocess.Popen([*command, "--domain", "0"], stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.addCleanup(self.program.stdout.close)
        self.addCleanup(self.program.wait, LIMIT)
        self.addCleanup(self.program.terminate)
        self.node = Node(json.loads(self.program.stdout.readline())["ros"][0])
        self.addCleanup(self.node.session.close)

    def test_a_publisher_of_humble_and_one_of_another_type_are_named(self):
        warned = lambda words: lambda: words in pathlib.Path(self.log.name).read_text(encoding="utf-8")
        for hashed, words in (("TypeHashNotSupported", "of ROS 2 humble"), ("RIHS01_" + 64 * "0", "has another type")):
            self.assertFalse(warned(words)())
            of = entity.EndpointEntity(
                self.node.node, 90, entity.EntityKind.PUBLISHER, "/imu/data_raw", "sensor_msgs::msg::dds_::Imu_", hashed, "1:2:1,10:,:,:,,"
            )
            self.node.token(keyexpr.endpoint_liveliness_keyexpr(of))
            wait(warned(words), f"warning {words!r}")

    def header(self, tick, frame="imu_link"):
        ns = START_NS + tick * TICK_NS
        stamp = STORE.types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
        return STORE.types["std_msgs/msg/Header"](stamp, frame)

    def imu(self, tick, rate):
        vector, none = STORE.types["geometry_msgs/msg/Vector3"], numpy.zeros(9)
        quaternion = STORE.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        return STORE.types["sensor_msgs/msg/Imu"](
            self.header(tick), quaternion, none, vector(*rate), none, vector(0.0, 0.0, 9.81), none
        )

    def test_a_node_is_served(self):
        node = self.node
        corrected = node.subscription("/imu/data", "sensor_msgs/msg/Imu")
        diagnostics = node.subscription("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        temperature = node.publisher("/imu/temperature/gyro0", "sensor_msgs/msg/Temperature")
        raw = node.publisher("/imu/data_raw", "sensor_msgs/msg/Imu")
        tokens = lambda: [str(it.ok.key_expr) for it in node.session.liveliness().get("@ros2_lv/0/**", timeout=LIMIT)]
        own = [it.split("/") for it in tokens() if it.endswith("/isotherm") or "/isotherm/" in it]
        kinds = sorted(it[5] for it in own)
        self.assertEqual(kinds, sorted(["NN"] + 2 * ["MP"] + 9 * ["MS"] + 3 * ["SS"]), own)

        count = 300
        for tick in range(count):
            if tick % 10 == 0:
                temperature(STORE.types["sensor_msgs/msg/Temperature"](self.header(tick), 1.75, 0.0))
            raw(self.imu(tick, (0.01, 0.02, 0.03)))
        token = next("/".join(it) for it in own if it[5] == "MP" and "%imu%data" in it)
        for tick in range(count):
            sample = corrected.get(timeout=LIMIT)
            of = attachment.Attachment.from_bytes(sample.attachment.to_bytes())
            self.assertEqual((of.sequence_id, of.gid), (tick + 1, gid(token)))
            message = STORE.deserialize_cdr(sample.payload.to_bytes(), "sensor_msgs/msg/Imu")
            self.assertEqual(message.header, self.header(tick))
            self.assertAlmostEqual(message.angular_velocity.x, 0.01, delta=0.005)
            self.assertAlmostEqual(message.linear_acceleration.z, 9.81, delta=0.5)
            self.assertEqual(message.orientation_covariance[0], -1.0)
            self.assertGreater(message.angular_velocity_covariance[0], 0.0)
            self.assertGreater(message.linear_acceleration_covariance[8], 0.0)

        status = STORE.deserialize_cdr(diagnostics.get(timeout=LIMIT).payload.to_bytes(), "diagnostic_msgs/msg/DiagnosticArray")
        self.assertEqual([it.hardware_id for it in status.status], ["MEMS-0001"])
        self.assertIn("imu in", [it.key for it in status.status[0].values])

        self.assertEqual(node.call("/isotherm/MEMS_0001/standby").message, "MEMS-0001: standby")
        answer = node.call("/isotherm/MEMS_0001/rollback")
        self.assertFalse(answer.success, answer)
        answer = node.call("/isotherm/MEMS_0001/run")
        self.assertTrue(answer.success and "running" in answer.message, answer)

        self.program.terminate()
        totals = json.loads(self.program.stdout.read())["units"]["MEMS-0001"]
        self.assertEqual((totals["imu_in"], totals["imu_out"], totals["lost"]), (count, count, 0), totals)
        self.assertEqual(self.program.wait(LIMIT), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
