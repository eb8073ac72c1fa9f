"""What the types of the layout cannot say."""

from __future__ import annotations

import math
from typing import Any, Callable, Dict

from . import _layout as layout

Message = Dict[str, Any]


class Refused(ValueError):
    """A frame that cannot be read, or a message that cannot be written; nothing of it is to be used."""


def _alike(message: Message) -> None:
    shape = None
    for index, tick in enumerate(message["ticks"]):
        ((variant, readings),) = tick["readings"].items()
        shape = shape or (variant, len(readings))
        if (variant, len(readings)) != shape:
            raise Refused(f"tick {index} of the batch has other readings than the first")
        if len(tick.get("half_periods", ())) not in (0, len(readings)):
            raise Refused(f"tick {index} has half-period counts of {len(tick['half_periods'])} gyros of {len(readings)}")


def _per_channel(message: Message) -> None:
    channels = len(message["channels"])
    for index, tick in enumerate(message["ticks"]):
        if len(tick["raw"]) != channels:
            raise Refused(f"tick {index} has {len(tick['raw'])} readings of {channels} channels")


def _span(message: Message) -> None:
    if message["end_ns"] <= message["start_ns"]:
        raise Refused("end_ns must be later than start_ns")
    if not all(math.isfinite(rate) for rate in message["angular_rate_rad_per_s"]):
        raise Refused("angular_rate_rad_per_s must be finite")
    if not (math.isfinite(message["sigma_rad_per_s"]) and message["sigma_rad_per_s"] >= 0):
        raise Refused("sigma_rad_per_s must be finite and not negative")


def _part(message: Message) -> None:
    if not message["part"] < message["parts"] <= layout.PARTS:
        raise Refused(f"part {message['part']} of {message['parts']}, at most {layout.PARTS}")


RULES: dict[str, Callable[[Message], None]] = {"alike": _alike, "per_channel": _per_channel, "span": _span, "part": _part}
