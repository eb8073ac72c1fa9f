"""What becomes of ticks, callbacks and processes when something ends badly; against a service that only listens."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
import unittest
from typing import Any

import isotherm
import zenoh
from common import LIMIT_S, frozen

UNIT = "PY-0002"
PERIOD_NS = 5_000_000
#: Closes nothing: a process with streams, a callback and a batch that is not full.
PROCESS = f"""
import isotherm
bus = isotherm.connect("ENDPOINT")
streams = [bus.corrected(), bus.corrected(callback=print), bus.status_stream()]
producer = bus.producer("{UNIT}", batch_ticks=64, max_in_flight=512)
for k in range(100):
    producer.gyro((k + 1) * {PERIOD_NS}, {PERIOD_NS}, [1, 2, 3])
"""


def free() -> str:
    """An endpoint: in Python a session does not say which port the system has chosen."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


class Listener:
    """Takes raw ticks, and answers for the status."""

    def __init__(self, endpoint: str) -> None:
        self.endpoint = endpoint
        config = zenoh.Config()
        config.insert_json5("listen/endpoints", json.dumps([self.endpoint]))
        config.insert_json5("scouting/multicast/enabled", "false")
        self.session = zenoh.open(config)
        self._numbers: list[int] = []
        self._changed = threading.Condition()
        self.session.declare_subscriber("imu/*/raw/*", self._take)
        self.session.declare_queryable("imu/*/status", lambda query: query.drop())

    def _take(self, sample: zenoh.Sample) -> None:
        if str(sample.key_expr).endswith("/gyro"):
            batch = isotherm.decode(sample.payload.to_bytes(), isotherm.RAW_GYRO)
            with self._changed:
                self._numbers += range(batch["first_sequence"], batch["first_sequence"] + len(batch["ticks"]))
                self._changed.notify_all()

    def numbers(self, count: int) -> list[int]:
        """Those of the ticks received, once there are so many."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._numbers) >= count, LIMIT_S)
            return list(self._numbers)


def give(producer: isotherm.Producer, *numbers: int) -> None:
    for k in numbers:
        producer.gyro((k + 1) * PERIOD_NS, PERIOD_NS, [1, 2, 3], sequence=k)


class Ends(unittest.TestCase):
    def setUp(self) -> None:
        self.service = Listener(free())
        self.addCleanup(self.service.session.close)

    def bus(self, timeout_s: float) -> isotherm.Bus:
        bus = isotherm.connect(self.service.endpoint, timeout_s=timeout_s)
        self.addCleanup(bus.close)
        return bus

    def test_ticks_that_could_not_be_sent_go_with_the_next_batch(self) -> None:
        with self.bus(1.0).producer(UNIT, batch_ticks=64, max_in_flight=256) as producer:
            for given, first in [(0, 0), (320, 256)]:
                words = f"gyro ticks {first}…{first + 255} were sent and none came back for 1 s; 64 more wait"
                with self.assertRaisesRegex(TimeoutError, words):
                    give(producer, *range(given, 576))
            self.assertEqual(producer.sent, 512)
        self.assertEqual(self.service.numbers(576), list(range(576)))

    def test_what_nobody_hears_is_counted_and_told(self) -> None:
        with self.bus(LIMIT_S).producer(UNIT, batch_ticks=1) as producer:
            give(producer, 0)
            self.service.session.close()
            deadline = time.monotonic() + LIMIT_S
            with self.assertLogs("isotherm", "WARNING") as logs:
                while producer.unheard < 10:
                    self.assertLess(time.monotonic(), deadline)
                    give(producer, producer.sent)
            self.assertRegex(logs.output[0], f"{UNIT}: nobody subscribes: gyro ticks from {producer.sent - 10} on are lost")
            self.assertEqual(len(logs.output), 1)

    def test_what_is_never_sent_is_named(self) -> None:
        producer = self.bus(1.0).producer(UNIT, batch_ticks=256, max_in_flight=512)
        give(producer, 0, 1)
        producer.gyro(3 * PERIOD_NS, 0, [1, 2, 1 << 40], sequence=2)
        # The tick that shows the gap is taken, whatever is raised.
        with self.assertRaisesRegex(isotherm.Refused, f"imu/{UNIT}/raw/gyro: not sent: gyro ticks 0…2: "):
            give(producer, 10)
        give(producer, *range(11, 530))
        with self.assertLogs("isotherm", "ERROR") as logs:
            producer.close()
        self.assertRegex(logs.output[0], r"closed, not sent: gyro ticks 522…529 \(.*gyro ticks 10…521 were sent and none came back")
        self.assertEqual(self.service.numbers(512), list(range(10, 522)))

    def test_ticks_of_another_run_come_back_to_nobody(self) -> None:
        bus = self.bus(1.0)
        # As the frozen batch has them.
        for series in [1, 0]:
            with bus.producer("ZLG-0042", batch_ticks=8, max_in_flight=256, series=series) as producer:
                give(producer, *range(1000, 1008))
                self.service.session.put("imu/ZLG-0042/corrected", frozen("corrected"))
                if series == 0:
                    producer.drain()
                    continue
                with self.assertRaisesRegex(TimeoutError, "gyro ticks 1000…1007 were sent and none came back"):
                    producer.drain()

    def test_a_callback_that_raises_is_reported_and_the_stream_goes_on(self) -> None:
        done = threading.Event()
        seen: list[str] = []

        def take(batch: isotherm.CorrectedBatch) -> Any:
            seen.append(batch.unit)
            if len(seen) == 3:
                done.set()
            raise KeyError(len(seen))

        bus = self.bus(LIMIT_S)
        stream = bus.corrected(callback=take, first_wins=False)
        with self.assertLogs("isotherm", "ERROR") as logs:
            for _ in range(3):
                self.service.session.put("imu/ZLG-0042/corrected", frozen("corrected"))
            self.assertTrue(done.wait(LIMIT_S))
            stream.close()
        self.assertEqual((stream.errors, repr(stream.error)), (3, "KeyError(3)"))
        self.assertEqual(len(logs.output), 3)
        self.assertIn("Traceback", logs.output[0])

    def test_a_process_that_closes_nothing_ends_and_sends_what_it_was_given(self) -> None:
        start = time.monotonic()
        process = [sys.executable, "-c", PROCESS.replace("ENDPOINT", self.service.endpoint)]
        done = subprocess.run(process, capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertLess(time.monotonic() - start, LIMIT_S / 2)
        self.assertEqual(self.service.numbers(100), list(range(100)))

    def test_a_service_that_comes_late_or_again_is_found_and_one_of_several_is_enough(self) -> None:
        for others in [(), ("127.0.0.1:1",)]:
            endpoint = free()
            opened: list[isotherm.Bus] = []
            connect = threading.Thread(target=lambda: opened.append(isotherm.connect(endpoint, *others, timeout_s=LIMIT_S)))
            connect.start()
            service = Listener(endpoint)
            connect.join(LIMIT_S)
            with opened[0] as bus:
                stream = bus.corrected(first_wins=False)
                for _ in range(2):
                    while stream.take(0.02) is None:
                        service.session.put("imu/ZLG-0042/corrected", frozen("corrected"))
                    service.session.close()
                    while stream.take(0.02) is not None:
                        pass
                    service = Listener(endpoint)
            service.session.close()


if __name__ == "__main__":
    unittest.main()
