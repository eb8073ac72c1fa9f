"""Recordings, Parquet and wire files of the project's own programs, against their CSV; plots."""

from __future__ import annotations

import csv
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import isotherm
import numpy as np
from common import BROKEN, LIMIT_S, REPLAY, ROOT, frozen, vectors

UNIT = "MEMS-0001"
DOCUMENT = ROOT / f"config/calibration/{UNIT}.toml"


class Files(unittest.TestCase):
    folder: pathlib.Path

    @classmethod
    def setUpClass(cls) -> None:
        place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(place.cleanup)
        cls.folder = pathlib.Path(place.name)
        cls.replay("simulate", "--preset", "mems-chamber", "--duration", "12", "--out", "log.csv")
        common = ["correct", "log.csv", "--mapping", "log.mapping.toml", "--unit", UNIT, "--calibration", str(DOCUMENT)]
        cls.replay(*common, "--out", "corrected.csv")
        cls.replay(*common, "--out", "corrected.wire", "--format", "wire")
        cls.replay("convert", "log.csv", "--out", "raw.mcap", "--mapping", "log.mapping.toml", "--unit", UNIT)
        cls.replay("correct", "raw.mcap", "--calibration", str(DOCUMENT), "--out", "corrected.mcap")
        cls.replay("convert", "corrected.mcap", "--out", "tables", "--to", "parquet")

    @classmethod
    def replay(cls, *arguments: str) -> None:
        done = subprocess.run([REPLAY, *arguments], cwd=cls.folder, capture_output=True, text=True, timeout=LIMIT_S)
        if done.returncode != 0:
            raise RuntimeError(f"isotherm-replay {' '.join(arguments)}: {done.stderr}")

    @classmethod
    def octave(cls, script: str) -> "subprocess.CompletedProcess[str]":
        command = ["octave-cli", "--quiet", "--no-gui", "--path", str(ROOT / "clients/matlab"), "--eval", script]
        return subprocess.run(command, cwd=cls.folder, capture_output=True, text=True, timeout=LIMIT_S)

    def table(self, name: str) -> "list[dict[str, str]]":
        with open(self.folder / name, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def frames(self) -> "list[bytes]":
        return list(isotherm.read_wire(self.folder / "corrected.wire"))

    def small_frames(self) -> "list[bytes]":
        """The same ticks in batches of 50."""
        small = []
        for frame in self.frames():
            message = isotherm.decode(frame, isotherm.CORRECTED)
            ticks = message["ticks"]
            parts = [{**message, "ticks": ticks[at : at + 50]} for at in range(0, len(ticks), 50)]
            small += [isotherm.encode(part, isotherm.CORRECTED) for part in parts]
        return small

    def check(self, ticks: "isotherm._arrays.Array") -> None:
        rows = self.table("corrected.csv")
        self.assertGreater(len(rows), 500)
        self.assertEqual(ticks.dtype, isotherm.TICK)
        for name in ("sequence", "end_time_ns", "duration_ns", "ticks", "missed", "flags"):
            self.assertEqual(ticks[name].tolist(), [int(row[name]) for row in rows], name)
        for index, axis in enumerate("xyz"):
            angles = [float(row[f"delta_angle_{axis}_rad"]) for row in rows]
            np.testing.assert_array_equal(ticks["delta_angle_rad"][:, index], angles)
            velocities = [float(row[f"delta_velocity_{axis}_m_per_s"]) for row in rows]
            np.testing.assert_array_equal(ticks["delta_velocity_m_per_s"][:, index], velocities)
        flags = [[int(cell) for cell in row["gyro_flags"].split()] for row in rows]
        self.assertEqual([tick["gyro_flags"][: tick["gyros"]].tolist() for tick in ticks], flags)

    def test_a_recording_holds_what_the_csv_says(self) -> None:
        recording = isotherm.read_recording(self.folder / "corrected.mcap")
        self.check(recording.corrected[UNIT])
        self.assertEqual(recording.refused, [])
        self.assertEqual(recording.accounts[UNIT].lost, 0)
        self.assertEqual(len(recording.revisions[UNIT]), len(recording.corrected[UNIT]))

    def test_raw_recordings_hold_what_the_log_says(self) -> None:
        recording = isotherm.read_recording(self.folder / "raw.mcap", units=[UNIT])
        raw = recording.raw_gyro[UNIT]
        self.assertEqual(raw["sensors"].tolist(), [3] * len(raw))
        self.assertTrue(np.isfinite(raw["readings"][:, :3]).all() and np.isnan(raw["readings"][:, 3:]).all())
        self.assertTrue((np.diff(raw["end_time_ns"]) > 0).all())
        self.assertEqual(len(recording.raw_accel[UNIT]), len(raw))
        self.assertGreater(len(recording.raw_temperature[UNIT]), 0)
        self.assertEqual(isotherm.read_recording(self.folder / "raw.mcap", units=["OTHER"]).raw_gyro, {})

    def test_parquet_holds_what_the_csv_says(self) -> None:
        self.check(isotherm.read_parquet(self.folder / f"tables/{UNIT}/corrected.parquet"))
        applied = isotherm.read_parquet(self.folder / f"tables/{UNIT}/applied_temperature.parquet")
        self.assertTrue(np.isfinite(applied["temperature_deg_c"]).all() and isinstance(applied["channel"][0], str))

    def test_a_wire_file_holds_what_the_csv_says(self) -> None:
        decoder = isotherm.CorrectedDecoder()
        batches = [decoder.decode(frame) for frame in isotherm.read_wire(self.folder / "corrected.wire")]
        self.check(np.concatenate([batch.ticks for batch in batches]))

    def test_files_that_cannot_be_read_are_named(self) -> None:
        whole = (self.folder / "corrected.mcap").read_bytes()
        tables = self.folder / f"tables/{UNIT}/corrected.parquet"
        wire = (self.folder / "corrected.wire").read_bytes()
        cases = [
            ("cut.mcap", whole[: len(whole) // 2], isotherm.read_recording, "cut short; try isotherm-replay recover"),
            ("not.mcap", b"something else entirely", isotherm.read_recording, "no recording"),
            ("cut.parquet", tables.read_bytes()[:500], isotherm.read_parquet, "no Parquet file, or cut short"),
            ("cut.wire", wire[:-3], lambda path: list(isotherm.read_wire(path)), "cut short in the frame at byte"),
            ("long.wire", b"\xff" * 8, lambda path: list(isotherm.read_wire(path)), "4294967295 bytes, at most 1048576"),
        ]
        for name, data, read, words in cases:
            path = self.folder / name
            path.write_bytes(data)
            with self.subTest(name), self.assertRaisesRegex(isotherm.Unreadable, f"{name}: .*{words}"):
                read(path)
        with self.assertRaises(FileNotFoundError):
            isotherm.read_recording(self.folder / "none.mcap")

    def test_a_damaged_frame_of_a_recording_is_named_and_the_rest_is_read(self) -> None:
        from mcap.writer import CompressionType, Writer

        frames = self.small_frames()
        middle = len(frames) // 2
        damaged = bytearray(frames[middle])
        damaged[10] ^= 1
        path = self.folder / "damaged.mcap"
        with open(path, "wb") as file:
            writer = Writer(file, compression=CompressionType.NONE)
            writer.start()
            schema = writer.register_schema("isotherm/corrected", "isotherm-wire", b"")
            channel = writer.register_channel(f"imu/{UNIT}/corrected", "isotherm", schema)
            for index, frame in enumerate(frames):
                writer.add_message(channel, index, bytes(damaged) if index == middle else frame, index)
            writer.finish()
        recording = isotherm.read_recording(path)
        self.assertEqual(len(recording.refused), 1)
        self.assertRegex(recording.refused[0], f"imu/{UNIT}/corrected: the checksum is")
        lost = len(isotherm.CorrectedDecoder().decode(frames[middle]).ticks)
        self.assertEqual(recording.accounts[UNIT].lost, lost)

    @unittest.skipUnless(shutil.which("octave-cli"), "octave-cli not found (Debian: apt install octave)")
    def test_octave_reads_the_same_to_the_bit(self) -> None:
        frames = self.small_frames()
        damaged = bytearray(frames[3])
        damaged[20] ^= 1
        broken = frames[:3] + [bytes(damaged), frames[3][:40], b""] + frames[4:]
        (self.folder / "broken.wire").write_bytes(b"".join(len(frame).to_bytes(4, "little") + frame for frame in broken))
        paths = ["corrected.wire", "broken.wire", *(["corrected.mcap"] if shutil.which("zstd") else [])]
        script = """
            for name = {%s}
              u = isotherm(name{1});
              printf('%%s %%s %%d\\n', name{1}, u.unit, numel(u.sequence));
              for k = 1:numel(u.sequence)
                printf('%%s %%s %%s %%s ', num2str(u.sequence(k)), num2str(u.end_time_ns(k)), num2str(u.duration_ns(k)), num2str(u.flags(k)));
                printf('%%d ', u.mode(k), u.gyros(k), u.gyro_flags(k, 1:3), u.revision(k));
                printf('%%.17g ', u.delta_angle_rad(k, :), u.delta_velocity_m_per_s(k, :));
                printf('\\n');
              end
            end
        """ % ", ".join(f"'{path}'" for path in paths)
        done = self.octave(script)
        lines = done.stdout.splitlines()
        decoder = isotherm.CorrectedDecoder()
        for path in paths:
            kept = frames[:3] + frames[4:] if path.startswith("broken") else self.frames()
            batches = [decoder.decode(frame) for frame in kept]
            ticks = np.concatenate([batch.ticks for batch in batches])
            self.assertEqual(lines.pop(0), f"{path} {UNIT} {len(ticks)}", done.stderr)
            for tick in ticks:
                words = lines.pop(0).split()
                whole = [tick[name] for name in ("sequence", "end_time_ns", "duration_ns", "flags", "mode", "gyros")]
                whole += [*tick["gyro_flags"][:3], batches[0].revision]
                self.assertEqual(words[:10], [str(int(value)) for value in whole])
                numbers = [*tick["delta_angle_rad"], *tick["delta_velocity_m_per_s"]]
                self.assertEqual([float(word) for word in words[10:]], [float(value) for value in numbers])
        self.assertRegex(done.stderr, "broken.wire: 3 of .* frames cannot be read")

    @unittest.skipUnless(shutil.which("octave-cli"), "octave-cli not found (Debian: apt install octave)")
    def test_octave_reads_every_column_of_parquet_to_the_bit(self) -> None:
        import pyarrow.parquet

        path = self.folder / f"tables/{UNIT}/corrected.parquet"
        done = self.octave(
            f"""
            u = isotherm('{path}');
            for name = fieldnames(u)'
              v = u.(name{{1}});
              file = fopen(['column-' name{{1}}], 'w');
              if iscell(v), fprintf(file, '%s\\n', v{{:}}); else, fwrite(file, v, class(v)); end
              fclose(file);
              printf('%s %s\\n', name{{1}}, class(v));
            end
            """
        )
        table = pyarrow.parquet.read_table(path)
        classes = dict(line.split() for line in done.stdout.splitlines())
        self.assertEqual(list(classes), table.column_names, done.stderr)
        for name, of in classes.items():
            expected, found = table[name], self.folder / f"column-{name}"
            if of == "cell":
                self.assertEqual(found.read_text(encoding="utf-8").splitlines(), [text or "" for text in expected.to_pylist()], name)
                continue
            numbers = np.fromfile(found, dtype={"logical": "uint8", "double": "float64"}.get(of, of))
            self.assertEqual(len(numbers), len(table), name)
            whole = expected.null_count == 0
            np.testing.assert_array_equal(numbers, expected.to_numpy() if whole else expected.cast("float64").to_numpy(), name)

    @unittest.skipUnless(shutil.which("octave-cli"), "octave-cli not found (Debian: apt install octave)")
    def test_octave_says_what_is_wrong_with_a_frame_and_a_file(self) -> None:
        frame = frozen("corrected")
        reasons = {
            "corrected-half": "the checksum does not fit",
            "corrected-bit": "the checksum does not fit",
            "corrected-truncated": "the body ends too early",
            "corrected-kind": "kind 1, not 4",
            "corrected-version-9": "version 9 is not known here",
            "corrected-claim": "the body ends too early",
        }
        cases = [(frozen(name), reasons[name]) for name in BROKEN]
        for number, (broken, _) in enumerate(cases):
            entries = b"".join(len(entry).to_bytes(4, "little") + entry for entry in (frame, broken, frame))
            (self.folder / f"one-{number}.wire").write_bytes(entries)
        (self.folder / "absurd.wire").write_bytes(b"\xff" * 8)
        (self.folder / "cut.wire").write_bytes(len(frame).to_bytes(4, "little") + frame[:-3])
        whole = (self.folder / f"tables/{UNIT}/corrected.parquet").read_bytes()
        (self.folder / "table.parquet").write_bytes(b"PAR1")
        (self.folder / "cut.parquet").write_bytes(whole[: len(whole) // 2])
        (self.folder / "lacking.parquet").write_bytes(whole[:4] + whole[104:])
        done = self.octave(
            """
            for k = 0:%d
              lastwarn('');
              u = isotherm(sprintf('one-%%d.wire', k));
              printf('%%d %%s\\n', numel(u.sequence), lastwarn());
            end
            for name = {'absurd.wire', 'cut.wire', 'table.parquet', 'cut.parquet', 'lacking.parquet'}
              try
                isotherm(name{1});
              catch problem
                printf('%%s\\n', problem.message);
              end
            end
            """
            % (len(cases) - 1)
        )
        lines = done.stdout.splitlines()
        self.assertEqual(len(lines), len(cases) + 5, done.stderr)
        ticks = 2 * len(isotherm.CorrectedDecoder().decode(frame).ticks)
        for line, (_, words) in zip(lines, cases):
            self.assertRegex(line, f"^{ticks} .*1 of 3 frames cannot be read; the last: {words}")
        for line, words in zip(lines[len(cases) :], ["4294967295 bytes, at most 1048576", "cut short at byte 0", *["no whole Parquet file"] * 3]):
            self.assertIn(words, line)

    @unittest.skipUnless(shutil.which("octave-cli"), "octave-cli not found (Debian: apt install octave)")
    def test_octave_takes_and_refuses_the_frozen_frames(self) -> None:
        published = vectors()
        for number, vector in enumerate(published):
            frame = vector.frame
            (self.folder / f"frozen-{number}.wire").write_bytes(len(frame).to_bytes(4, "little") + frame)
        script = """
            for k = 0:%d
              lastwarn('');
              u = isotherm(sprintf('frozen-%%d.wire', k));
              if isempty(u)
                printf('refused: %%s\\n', lastwarn());
              else
                printf('%%s', strtrim(disp(u.sequence(end))));
                printf(' %%.17g', u.angle_sigma_rad(end, :), u.velocity_sigma_m_per_s(end, :));
                printf('\\n');
              end
            end
        """ % (len(published) - 1)
        done = self.octave(script)
        lines = done.stdout.splitlines()
        self.assertEqual(len(lines), len(published), done.stderr)
        decoder = isotherm.CorrectedDecoder()
        for vector, line in zip(published, lines):
            with self.subTest(vector.name):
                if vector.kind != isotherm.CORRECTED or vector.message is None:
                    self.assertRegex(line, "^refused: .* 1 of 1 frames cannot be read")
                    continue
                tick = decoder.decode(vector.frame).ticks[-1]
                sequence, *sigmas = line.split()
                self.assertEqual(int(sequence), tick["sequence"])
                expected = [*tick["angle_sigma_rad"].ravel(), *tick["velocity_sigma_m_per_s"].ravel()]
                np.testing.assert_array_equal([float(sigma) for sigma in sigmas], expected)

    def test_a_plot_shows_both_quantities(self) -> None:
        import matplotlib

        matplotlib.use("Agg")
        ticks = isotherm.read_parquet(self.folder / f"tables/{UNIT}/corrected.parquet")
        ticks["flags"][100] |= isotherm.TickFlag.GAP
        figure = isotherm.plot(ticks, title=UNIT)
        rates, forces = figure.axes
        self.assertEqual([len(axes.get_lines()) >= 3 for axes in (rates, forces)], [True, True])
        drawn = np.radians(rates.get_lines()[2].get_ydata())
        np.testing.assert_allclose(drawn, isotherm.angular_rate(ticks)[:, 2])
        self.assertIn("gap: 1", [text.get_text() for text in rates.get_legend().get_texts()])
        with self.assertRaisesRegex(ValueError, "no ticks"):
            isotherm.plot(ticks[:0])


if __name__ == "__main__":
    unittest.main()
