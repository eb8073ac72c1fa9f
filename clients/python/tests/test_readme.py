"""The five lines of each client in clients/README.md, run as they stand there."""

from __future__ import annotations

import pathlib
import re
import shutil
import subprocess
import tempfile
import textwrap
import threading
import unittest
from typing import Any
from unittest import mock

import isotherm
import numpy as np
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


def lines(language: str) -> str:
    """The only block of a language."""
    (block,) = re.findall(f"```{language}\n(.*?)```", (CLIENTS / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    return str(block)


class Enough(Exception):
    """Ends the loop, which has no end of its own."""


class FiveLines(unittest.TestCase):
    def test_of_python_print_what_the_service_corrects(self) -> None:
        printed: list[Any] = []
        enough = threading.Event()

        def produce(bus: isotherm.Bus) -> None:
            with bus.producer("ZLG-0001", batch_ticks=1) as producer:
                k = 0
                while not enough.wait(0.001):
                    k += 1
                    producer.gyro(k * 5_000_000, 5_000_000, [0.25, -0.5, 0.75])

        def take(value: Any) -> None:
            printed.append(value)
            raise Enough

        with Service() as service, isotherm.connect(service.endpoint, timeout_s=LIMIT_S) as bus:
            thread = threading.Thread(target=produce, args=(bus,))
            thread.start()
            try:
                with mock.patch("isotherm._bus.ENDPOINT", service.endpoint), self.assertRaises(Enough):
                    exec(lines("python"), {"print": take})
            finally:
                enough.set()
                thread.join(LIMIT_S)
        np.testing.assert_array_equal(printed[0][0], [0.25, -0.5, 0.75])

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
