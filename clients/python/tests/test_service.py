"""The package against the real service: raw ticks in, corrected ticks out, calibrations, commands, two services."""

from __future__ import annotations

import threading
import unittest
import unittest.mock
from typing import Any

import isotherm
import numpy as np
import zenoh
from common import BROKEN, LIMIT_S, ROOT, Service, frozen

UNIT = "PY-0001"
PERIOD_NS = 5_000_000


def reading(k: int) -> list[float]:
    """Means with all their digits in use."""
    return [np.sin(k / 7.0), np.cos(k / 11.0), np.sin(k / 13.0)]


def produce(bus: isotherm.Bus, count: int, *, first: int = 0, batch: int = 8, **options: Any) -> None:
    with bus.producer(UNIT, batch_ticks=batch, **options) as producer:
        for k in range(first, first + count):
            producer.gyro((k + 1) * PERIOD_NS, PERIOD_NS, reading(k), sequence=k)
        if options.get("max_in_flight"):
            producer.drain()
            assert producer.in_flight == 0


def receive(stream: isotherm.CorrectedStream, count: int) -> Any:
    """Outputs until `count` raw ticks have come."""
    parts: list[Any] = []
    while sum(len(part) for part in parts) < count:
        parts.append(next(stream).ticks)
    return np.concatenate(parts)


class OneService(unittest.TestCase):
    def setUp(self) -> None:
        self.service = self.enterContext_(Service())
        self.bus = self.enterContext_(isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S))

    def enterContext_(self, manager: Any) -> Any:
        """`enterContext` of Python 3.11."""
        entered = manager.__enter__()
        self.addCleanup(manager.__exit__, None, None, None)
        return entered

    def test_every_tick_comes_back_to_the_bit(self) -> None:
        stream = self.bus.corrected(UNIT, timeout_s=LIMIT_S)
        produce(self.bus, 3000, batch=7, max_in_flight=512)
        ticks = receive(stream, 3000)
        np.testing.assert_array_equal(ticks["sequence"], np.arange(3000))
        np.testing.assert_array_equal(ticks["end_time_ns"], PERIOD_NS * np.arange(1, 3001))
        # Without a calibration raw readings are passed through.
        np.testing.assert_array_equal(ticks["delta_angle_rad"], [reading(k) for k in range(3000)])
        self.assertTrue((ticks["flags"] & isotherm.TickFlag.UNCALIBRATED).all())
        account = stream.accounts[UNIT]
        self.assertEqual((account.ticks, account.lost, account.duplicated, account.restarts), (3000, 0, 0, 0))

    def test_a_gap_and_a_restart_are_told(self) -> None:
        stream = self.bus.corrected("*", timeout_s=LIMIT_S)
        produce(self.bus, 100)
        produce_again = isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S)
        with produce_again as other:
            with other.producer(UNIT, batch_ticks=16) as producer:
                for k in range(200):
                    if not 50 <= k < 55:
                        producer.gyro((1000 + k) * PERIOD_NS, PERIOD_NS, reading(k), sequence=k)
            receive(stream, 100 + 195)
            other.wait_for_receipts()
        account = stream.accounts[UNIT]
        self.assertEqual((account.ticks, account.announced_missing, account.lost, account.restarts), (295, 5, 0, 1))

    def test_frames_that_cannot_be_read_are_counted_and_the_stream_goes_on(self) -> None:
        stream = self.bus.corrected(UNIT, timeout_s=LIMIT_S)
        broken = [b"", *map(frozen, BROKEN)]
        # From another session: it takes the way of every frame.
        with isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S) as other:
            for frame in broken:
                other.session.put(
                    f"imu/{UNIT}/corrected",
                    frame,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.REAL_TIME,
                )
            # A query is no faster than what was published before it.
            other.wait_for_receipts()
        produce(self.bus, 50)
        self.assertEqual(len(receive(stream, 50)), 50)
        self.assertEqual(stream.refused, len(broken))
        self.assertRegex(stream.last_refusal or "", f"imu/{UNIT}/corrected: a text has 268435455 bytes")

    def test_a_callback_has_its_own_thread_and_a_slow_one_drops_the_oldest(self) -> None:
        seen: list[int] = []
        threads, gate, done = set(), threading.Event(), threading.Event()

        def take(batch: isotherm.CorrectedBatch) -> None:
            gate.wait(LIMIT_S)
            threads.add(threading.current_thread().name)
            seen.extend(batch.ticks["sequence"].tolist())
            if seen[-1] == 99:
                done.set()

        stream = self.bus.corrected(UNIT, callback=take, most_waiting=5)
        whole = self.bus.corrected(UNIT, timeout_s=LIMIT_S)
        produce(self.bus, 100, batch=1)
        receive(whole, 100)
        gate.set()
        self.assertTrue(done.wait(LIMIT_S))
        self.assertEqual(threads, {f"isotherm imu/{UNIT}/corrected"})
        self.assertGreater(stream.messages_dropped, 0)
        self.assertEqual(stream.accounts[UNIT].lost + len(seen), 100 - seen[0])
        stream.close()
        self.assertIsNone(stream.error)

    def test_silence_ends_in_an_error_that_says_so(self) -> None:
        stream = self.bus.corrected(UNIT, timeout_s=0.05)
        with self.assertRaisesRegex(TimeoutError, "no message for 0.05 s"):
            next(stream)
        stream.close()
        self.assertEqual(list(stream), [])

    def test_operators_swap_command_and_look_back(self) -> None:
        document = (ROOT / "config/calibration/MEMS-0001.toml").read_text(encoding="utf-8")
        self.assertEqual(self.bus.swap("MEMS-0001", document, by="ann", dry_run=True, force=True)["outcome"], "would-be-accepted")
        reply = self.bus.swap("MEMS-0001", ROOT / "config/calibration/MEMS-0001.toml", by="a;n=n%", force=True)
        self.assertEqual((reply["outcome"], reply["revision"]), ("accepted", 1))
        self.assertEqual(self.bus.calibration("MEMS-0001"), document)
        with self.assertRaisesRegex(isotherm.BusError, "has not appeared"):
            self.bus.command("MEMS-0001", "standby")
        with self.bus.producer("MEMS-0001") as producer:
            producer.gyro(PERIOD_NS, PERIOD_NS, reading(0))
        self.bus.wait_for_receipts()
        with self.assertRaisesRegex(isotherm.NotAccepted, r"\d+:\d+: unit: ") as caught:
            self.bus.swap("MEMS-0001", ROOT / "config/calibration/ZLG-0001.toml")
        self.assertEqual(caught.exception.reply["outcome"], "refused")
        self.assertEqual(self.bus.command("MEMS-0001", "standby", by="ann")["state"], "standby")
        with self.assertRaisesRegex(isotherm.NotAccepted, "abort"):
            self.bus.command("MEMS-0001", "abort")
        self.assertEqual(self.bus.status("MEMS-0001")["MEMS-0001"]["state"], "standby")
        with isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S, name="eve") as named:
            self.assertEqual(named.calibration("MEMS-0001"), document)
            named.command("MEMS-0001", "standby")
        self.assertEqual(self.bus.history("MEMS-0001", limit=1)[0]["by"], "eve")
        entries = self.bus.history("MEMS-0001", limit=10)
        self.assertIn("a;n=n%", [entry.get("by") for entry in entries])
        (service,) = self.bus.services().values()
        self.assertEqual(service["swaps_accepted"], 1)
        with self.assertRaisesRegex(isotherm.BusError, "NOBODY: no service knows this unit"):
            self.bus.status("NOBODY")

    def test_status_comes_by_itself(self) -> None:
        with self.bus.status_stream(timeout_s=LIMIT_S) as stream:
            produce(self.bus, 20)
            self.assertEqual(next(stream)["unit"], UNIT)

    def test_other_inputs_are_taken(self) -> None:
        stream = self.bus.corrected(UNIT, timeout_s=LIMIT_S)
        with self.bus.producer(UNIT, batch_ticks=4, series=7) as producer:
            for k in range(40):
                end = (k + 1) * PERIOD_NS
                producer.temperatures(end, {"body": 20.0 + k, "fibre": 21.0})
                producer.accel(end, PERIOD_NS, [0.0, 0.0, 9.8])
                producer.gyro(end, PERIOD_NS, [k, -k, 2 * k], mode=1 if k < 20 else -1, switch_command=k == 20)
            producer.health(40 * PERIOD_NS, {"volts": 5.0})
            self.bus.reference(UNIT, 0, 2_000_000_000, [0.0, 0.0, 1e-5], 1e-6)
        ticks = receive(stream, 40)
        np.testing.assert_array_equal(ticks["delta_angle_rad"][:, 2], 2.0 * np.arange(40))
        self.assertEqual(ticks["mode"].tolist(), [1] * 20 + [-1] * 20)
        counters = {row["name"]: row["value"] for row in self.bus.status(UNIT)[UNIT]["counters"]}
        self.assertEqual((counters["gyro_ticks_in"], counters["accel_ticks_in"]), (40, 40))
        self.assertEqual((counters["temperature_readings_in"], counters["bad_frames"]), (80, 0))

    def test_receipts_are_given_and_waited_for(self) -> None:
        other = self.enterContext_(isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S))
        # Given by this bus.
        other.wait_for_receipts()
        held: list[zenoh.Query] = []
        silent = self.bus.session.declare_queryable(f"isotherm/{self.bus.session.zid()}/receipt", held.append)
        with self.assertRaisesRegex(isotherm.BusError, "not every subscriber"):
            other.wait_for_receipts(timeout_s=0.5)
        self.assertEqual(len(held), 1)
        held.pop().drop()
        silent.undeclare()
        stream = self.bus.corrected(UNIT, timeout_s=LIMIT_S)
        produce(self.bus, 64)
        # The service has them; what it publishes at last arrives, since it waits for the receipt.
        self.bus.wait_for_receipts()
        self.assertEqual(self.service.stop(), 0)
        self.assertEqual(len(receive(stream, 64)), 64)


class TwoServices(unittest.TestCase):
    def test_one_service_dies_and_no_tick_is_lost_or_comes_twice(self) -> None:
        with Service() as first, Service() as second:
            with isotherm.connect(first.endpoint, second.endpoint, timeout_s=LIMIT_S) as bus:
                stream = bus.corrected(UNIT, timeout_s=LIMIT_S)
                both = bus.corrected(UNIT, first_wins=False, timeout_s=LIMIT_S)
                with bus.producer(UNIT, batch_ticks=4) as producer:
                    for k in range(400):
                        producer.gyro((k + 1) * PERIOD_NS, PERIOD_NS, reading(k))
                    producer.flush()
                    # Both have answered for all of these.
                    self.assertEqual(len(receive(both, 800)), 800)
                    first.process.kill()
                    first.process.wait(LIMIT_S)
                    for k in range(400, 800):
                        producer.gyro((k + 1) * PERIOD_NS, PERIOD_NS, reading(k))
                ticks = receive(stream, 800)
        np.testing.assert_array_equal(ticks["sequence"], np.arange(800))
        np.testing.assert_array_equal(ticks["delta_angle_rad"], [reading(k) for k in range(800)])
        account = stream.accounts[UNIT]
        self.assertEqual((account.ticks, account.lost, account.duplicated), (800, 0, 0))
        self.assertEqual(stream.outputs_dropped, 400)


class NoService(unittest.TestCase):
    def test_nobody_there_is_an_error_with_the_endpoint(self) -> None:
        with self.assertRaisesRegex(isotherm.BusError, "tcp/127.0.0.1:1: no service or router answers within 0.3 s"):
            isotherm.connect("tcp/127.0.0.1:1", timeout_s=0.3)

    def test_the_environment_says_where_it_is(self) -> None:
        with unittest.mock.patch.dict("os.environ", ISOTHERM_CONNECT=" 127.0.0.1:1,tcp/127.0.0.1:2"):
            with self.assertRaisesRegex(isotherm.BusError, "tcp/127.0.0.1:1 or tcp/127.0.0.1:2: no service"):
                isotherm.connect(timeout_s=0.3)
            with self.assertRaisesRegex(isotherm.BusError, "^tcp/127.0.0.1:3: no service"):
                isotherm.connect("127.0.0.1:3", timeout_s=0.3)


if __name__ == "__main__":
    unittest.main()
