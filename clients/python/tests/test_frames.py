"""Frames against the frozen vectors, broken ones too; arrays against plain decoding."""

from __future__ import annotations

import importlib.resources
import math
import random
import unittest
from typing import Any

import isotherm
import numpy as np
from common import frozen, vectors, with_checksum


def without_nan(value: Any) -> Any:
    """JSON has no NaN and no infinity; the vectors have null."""
    if isinstance(value, dict):
        return {name: without_nan(item) for name, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def bits(values: Any) -> list[str]:
    return [float(value).hex() for value in values]


class Frames(unittest.TestCase):
    def test_frozen_frames_decode_to_their_json_and_encode_to_their_bytes(self) -> None:
        good = [vector for vector in vectors() if vector.message is not None]
        self.assertGreater(len(good), 20)
        for vector in good:
            with self.subTest(vector.name):
                message = isotherm.decode(vector.frame, vector.kind)
                self.assertEqual(without_nan(message), vector.message)
                self.assertEqual(isotherm.encode(message, vector.kind, vector.frame[1]), vector.frame)

    def test_broken_frames_are_refused(self) -> None:
        broken = [vector for vector in vectors() if vector.message is None]
        self.assertGreater(len(broken), 30)
        for vector in broken:
            with self.subTest(vector.name), self.assertRaises(isotherm.Refused) as caught:
                isotherm.decode(vector.frame, vector.kind)
            self.assertNotIn("\n", str(caught.exception))

    def test_refusals_say_what_is_wrong(self) -> None:
        frame = frozen("corrected")
        cases = [
            (frame[:5], "5 bytes, must have 6"),
            (frozen("corrected-kind"), "kind 1, its key promises 4"),
            (frozen("corrected-version-9"), "version 9, this package knows 1 to 3: update it"),
            (frozen("corrected-half"), "the checksum is"),
            (frozen("corrected-bit"), "the checksum is"),
            (frozen("corrected-truncated"), "ends too early"),
            (frozen("corrected-claim"), "a text has 268435455 bytes"),
            (with_checksum(frame[:-4] + b"\0"), "1 bytes are left over"),
            (b"\4" * ((1 << 20) + 1), "1048577 bytes"),
        ]
        for broken, words in cases:
            for decode in (lambda data: isotherm.decode(data, isotherm.CORRECTED), isotherm.CorrectedDecoder().decode):
                with self.assertRaisesRegex(isotherm.Refused, words):
                    decode(broken)


class Package(unittest.TestCase):
    def test_it_is_typed_and_says_everything_it_has(self) -> None:
        self.assertTrue((importlib.resources.files("isotherm") / "py.typed").is_file())
        for name in isotherm.__all__:
            self.assertTrue(hasattr(isotherm, name), name)
        self.assertEqual(isotherm.TickFlag.ANGLE_INVALID, 1 << 10)
        self.assertEqual(isotherm.SensorFlag.EXCLUDED, 1 << 5)


class Arrays(unittest.TestCase):
    def same(self, frame: bytes, decoder: isotherm.CorrectedDecoder) -> bool:
        """Both refuse a frame, or read the same in it."""
        try:
            plain = isotherm.decode(frame, isotherm.CORRECTED)
        except isotherm.Refused:
            with self.assertRaises(isotherm.Refused):
                decoder.decode(frame)
            return False
        batch = decoder.decode(frame)
        self.assertEqual((batch.unit, batch.revision), (plain["unit"], plain["revision"]["counter"]))
        self.assertEqual(len(batch.ticks), len(plain["ticks"]))
        for row, tick in zip(batch.ticks, plain["ticks"]):
            for name in ("sequence", "end_time_ns", "duration_ns", "ticks", "missed", "flags"):
                self.assertEqual(int(row[name]), tick[name], name)
            for name in ("delta_angle_rad", "delta_velocity_m_per_s"):
                self.assertEqual(bits(row[name]), bits(tick[name]), name)
            self.assertEqual(int(row["mode"]), {None: 0, "Plus": 1, "Minus": -1}[tick["mode"]])
            for name, count in (("gyro_flags", "gyros"), ("accel_flags", "accels")):
                self.assertEqual(row[name][: row[count]].tolist(), tick[name])
                self.assertEqual(row[name][row[count] :].sum(), 0)
            for name in ("gyro_parity_rad_per_s", "accel_parity_m_per_s2"):
                self.assertEqual(bits(row[name][: len(tick[name])]), bits(tick[name]))
                self.assertTrue(np.isnan(row[name][len(tick[name]) :]).all())
        for index, row in enumerate(batch.ticks):
            runs = [run for run in plain.get("sigmas", []) if run["from_tick"] <= index]
            stated = list(runs[-1].values())[1:] if runs else [[np.nan] * 3] * 8
            found = [*row["angle_sigma_rad"], *row["velocity_sigma_m_per_s"]]
            self.assertEqual([bits(causes) for causes in found], [bits(causes) for causes in stated])
        return True

    def test_arrays_hold_what_the_frozen_frames_say(self) -> None:
        decoder = isotherm.CorrectedDecoder()
        read = [self.same(vector.frame, decoder) for vector in vectors() if vector.kind == isotherm.CORRECTED]
        self.assertGreater(sum(read), 1)

    def test_one_changed_byte_is_read_or_refused_as_by_plain_decoding(self) -> None:
        decoder, outcomes = isotherm.CorrectedDecoder(), []
        for vector in vectors():
            if vector.kind != isotherm.CORRECTED:
                continue
            covered = vector.frame[:-4]
            for at in range(len(covered)):
                outcomes.append(self.same(with_checksum(covered[:at]), decoder))
                for change in (0x01, 0x80, 0xFF):
                    changed = bytearray(covered)
                    changed[at] ^= change
                    outcomes.append(self.same(with_checksum(bytes(changed)), decoder))
        self.assertTrue(any(outcomes) and not all(outcomes))

    def test_ticks_of_changing_form_are_read_as_by_plain_decoding(self) -> None:
        draw = random.Random(20)
        decoder = isotherm.CorrectedDecoder()
        for _ in range(200):
            ticks = []
            sequence = draw.choice([0, 120, (1 << 14) - 5, (1 << 64) - 40])
            for _ in range(draw.randint(1, 40)):
                sequence = min(sequence + 1, (1 << 64) - 1)
                ticks.append(
                    {
                        "sequence": sequence,
                        "end_time_ns": draw.choice([-1, 63, 64, 5_000_000, -(1 << 63), (1 << 63) - 1]),
                        "duration_ns": draw.choice([127, 128, 5_000_000, (1 << 64) - 1]),
                        "ticks": draw.choice([1, 1, 1, 4, 65535]),
                        "missed": draw.choice([0, 0, 0, 3, 200]),
                        "delta_angle_rad": [draw.uniform(-1, 1), math.nan, -0.0],
                        "delta_velocity_m_per_s": [draw.uniform(-1, 1), math.inf, 5e-324],
                        "mode": draw.choice([None, "Plus", "Minus"]),
                        "flags": draw.choice([0, 1, 0x100, 0xFFFF]),
                        "gyro_flags": draw.choices(range(256), k=draw.choice([3, 3, 4, 8, 0])),
                        "accel_flags": draw.choices(range(256), k=draw.choice([3, 3, 0])),
                        "gyro_parity_rad_per_s": [draw.uniform(-1, 1)] * draw.choice([0, 0, 1, 5]),
                        "accel_parity_m_per_s2": [],
                    }
                )
            message = {"unit": "ZLG-0001", "revision": {"counter": 3, "digest": "00" * 8}, "temperatures": [], "ticks": ticks}
            self.assertTrue(self.same(isotherm.encode(message, isotherm.CORRECTED), decoder))


if __name__ == "__main__":
    unittest.main()
