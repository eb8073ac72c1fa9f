"""What README.md, clients/README.md and clients/python/README.md show, run as it stands there."""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import threading
import unittest
from typing import Any
from unittest import mock

import isotherm
from common import LIMIT_S, REPLAY, ROOT, Service, frozen

CLIENTS = ROOT / "clients"
C_PROGRAM = """
#include "isotherm.h"
#include <stdio.h>
static void navigate(const double *angle, const double *velocity) {
    printf("%%.17g %%.17g\\n", angle[0], velocity[0]);
}
int main(void) {
    static uint8_t frame[ISOTHERM_MAX_FRAME_BYTES];
    const size_t length = fread(frame, 1, sizeof frame, stdin);
%s
    return 0;
}
"""


def blocks(readme: str, language: str) -> list[str]:
    """Those of a language."""
    return re.findall(f"```{language}\n(.*?)```", (ROOT / readme).read_text(encoding="utf-8"), re.DOTALL)


def lines(language: str) -> str:
    """The only block of a language."""
    (block,) = blocks("clients/README.md", language)
    return block


def run(folder: pathlib.Path, *command: str | pathlib.Path, **options: Any) -> None:
    """Runs a program; raises what it says where it fails."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, stdin=subprocess.DEVNULL, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{command}: {done.stderr}")


class Enough(Exception):
    """Ends the loop, which has no end of its own."""


class Programs(unittest.TestCase):
    def setUp(self) -> None:
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = pathlib.Path(place.name)
        (self.folder / "config").symlink_to(ROOT / "config")
        self.service = Service("--calibration", str(ROOT / "config/calibration"))
        self.addCleanup(self.service.__exit__)

    def five_lines(self, source: str) -> list[Any]:
        """Runs a loop until it prints."""
        printed: list[Any] = []
        enough = threading.Event()

        def produce(bus: isotherm.Bus) -> None:
            with bus.producer("ZLG-0001") as producer:
                k = 0
                while not enough.wait(0.001):
                    k += 1
                    producer.gyro(k * 5_000_000, 5_000_000, [12, -3, 40])

        def take(*values: Any) -> None:
            printed.extend(values)
            raise Enough

        with isotherm.connect(self.service.endpoint, timeout_s=LIMIT_S) as bus:
            thread = threading.Thread(target=produce, args=(bus,))
            thread.start()
            try:
                with mock.patch("isotherm._bus.ENDPOINT", self.service.endpoint), self.assertRaises(Enough):
                    exec(source, {"print": take})
            finally:
                enough.set()
                thread.join(LIMIT_S)
        return printed

    def test_five_lines_of_python_print_what_the_service_corrects(self) -> None:
        first, _ = blocks("clients/python/README.md", "python")
        for source in (lines("python"), first):
            self.assertEqual(self.five_lines(source)[-1].shape[1], 3)

    def test_the_rest_of_python_runs(self) -> None:
        document = self.folder / "config/calibration/ZLG-0001.toml"
        shutil.copy(document, self.folder / "new.toml")
        run(self.folder, REPLAY, "simulate", "--preset", "zeeman-sine", "--duration", "4", "--out", "log.csv")
        run(self.folder, REPLAY, "correct", "log.csv", "--calibration", document, "--out", "run.mcap")
        run(self.folder, REPLAY, "convert", "run.mcap", "--out", "tables", "--to", "parquet")
        _, source = blocks("clients/python/README.md", "python")
        run(self.folder, sys.executable, "-c", source, env={**os.environ, "ISOTHERM_CONNECT": self.service.endpoint})

    def test_daily_use_of_the_programs(self) -> None:
        document = (self.folder / "config/calibration/ZLG-0001.toml").read_text(encoding="utf-8")
        (self.folder / "new.toml").write_text(document + "# edited\n", encoding="utf-8")
        text = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Daily use")[2].partition("\n## ")[0]
        commands = re.findall(r"^\$ (isotherm(?:\\\n|.)*)", text, re.MULTILINE)
        self.assertEqual(len(commands), 10)
        path = f"{REPLAY.parent}{os.pathsep}{os.environ['PATH']}"
        for command in commands:
            # It is running, and nobody answers questions.
            if " serve " not in command:
                asks = " --yes" if re.search(" swap | rollback ", command) else ""
                line = command.partition("#")[0] + asks
                run(self.folder, "sh", "-c", line, env={**os.environ, "PATH": path, "ISOTHERM_CONNECT": self.service.endpoint})


class FiveLines(unittest.TestCase):
    @unittest.skipUnless(shutil.which("cc"), "cc not found (Debian: apt install gcc)")
    def test_of_c_navigate_by_a_frozen_frame(self) -> None:
        frame = frozen("corrected")
        with tempfile.TemporaryDirectory() as folder:
            source, program = pathlib.Path(folder, "five.c"), pathlib.Path(folder, "five")
            source.write_text(C_PROGRAM % textwrap.indent(lines("c"), "    "), encoding="utf-8")
            strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
            subprocess.run(["cc", *strict, "-I", CLIENTS / "c", "-o", program, source], check=True, timeout=LIMIT_S)
            said = subprocess.run([program], input=frame, capture_output=True, check=True, timeout=LIMIT_S).stdout.decode()
        ticks = isotherm.CorrectedDecoder().decode(frame).ticks
        expected = [[tick["delta_angle_rad"][0], tick["delta_velocity_m_per_s"][0]] for tick in ticks]
        self.assertEqual([[float(word) for word in line.split()] for line in said.splitlines()], expected)

    @unittest.skipUnless(shutil.which("octave-cli") and shutil.which("zstd"), "octave-cli or zstd not found")
    def test_of_matlab_read_a_recording(self) -> None:
        document = ROOT / "config/calibration/MEMS-0001.toml"
        with tempfile.TemporaryDirectory() as place:
            folder = pathlib.Path(place)
            (folder / "clients").symlink_to(CLIENTS)
            for command in (
                ["simulate", "--preset", "mems-chamber", "--duration", "4", "--out", "log.csv"],
                ["correct", "log.csv", "--mapping", "log.mapping.toml", "--calibration", document, "--out", "run.mcap"],
            ):
                subprocess.run([REPLAY, *command], cwd=folder, check=True, capture_output=True, timeout=LIMIT_S)
            # Octave without a display cannot plot: what is handed over is printed.
            seen = "function plot(time, rate), printf('%d ', size(time), size(rate), all(isfinite(rate(:)))); end\n"
            script = f"1;\n{seen}function xlabel(varargin), end\nfunction ylabel(varargin), end\n{lines('matlab')}"
            octave = ["octave-cli", "--quiet", "--norc", "--eval", script]
            done = subprocess.run(octave, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual((done.returncode, done.stdout.split()), (0, ["400", "1", "400", "3", "1"]), done.stderr)


if __name__ == "__main__":
    unittest.main()
