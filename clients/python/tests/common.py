"""What the tests share: places, the frozen vectors, and a service of their own."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import tempfile
import zlib
from dataclasses import dataclass
from typing import Any

ROOT = pathlib.Path(__file__).resolve().parents[3]
#: Programs of the project: `isotherm`, and beside it `isotherm-replay`.
ISOTHERM = pathlib.Path(os.environ.get("ISOTHERM_BIN", ROOT / "target/release/isotherm"))
REPLAY = ISOTHERM.with_name("isotherm-replay")
LIMIT_S = 60.0


@dataclass
class Vector:
    """A frame of docs/wire-vectors.txt; `message` is None where it must be refused."""

    name: str
    kind: int
    frame: bytes
    message: Any


def vectors() -> list[Vector]:
    found: list[dict[str, Any]] = []
    for line in (ROOT / "docs/wire-vectors.txt").read_text(encoding="utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        directive, _, rest = line.partition(" ")
        if directive in ("vector", "refuse"):
            name, _, kind = rest.partition(" ")
            found.append({"name": name, "kind": int(kind) if kind else None, "frame": b"", "json": ""})
        elif directive == "hex":
            found[-1]["frame"] += bytes.fromhex(rest.partition("#")[0])
        elif directive == "json":
            found[-1]["json"] += rest
        else:
            raise ValueError(f"no directive: {line}")
    return [
        Vector(v["name"], v["kind"] or v["frame"][0], v["frame"], json.loads(v["json"]) if v["json"] else None) for v in found
    ]


def frozen(name: str) -> bytes:
    """The frame of this name."""
    return next(vector.frame for vector in vectors() if vector.name == name)


#: The corrected batches that are broken, each in a way of its own.
BROKEN = ["corrected-half", "corrected-bit", "corrected-truncated", "corrected-kind", "corrected-version-9", "corrected-claim"]


def with_checksum(covered: bytes) -> bytes:
    """A frame of these bytes."""
    return covered + zlib.crc32(covered).to_bytes(4, "little")


class Service:
    """A service on a port of the system's choice, with a document; ends with the `with` statement."""

    def __init__(self, *arguments: str) -> None:
        self._folder = tempfile.TemporaryDirectory()
        command = [ISOTHERM, "serve", "--announce", "--json", "--listen", "tcp/127.0.0.1:0", *arguments]
        self.process = subprocess.Popen(
            command, cwd=self._folder.name, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, encoding="utf-8"
        )
        assert self.process.stdout is not None
        self.endpoint: str = json.loads(self.process.stdout.readline())["locators"][0]

    def __enter__(self) -> Service:
        return self

    def stop(self) -> int:
        self.process.terminate()
        return self.process.wait(LIMIT_S)

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(LIMIT_S)
        if self.process.stdout is not None:
            self.process.stdout.close()
        self._folder.cleanup()
