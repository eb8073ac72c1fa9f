"""Waiting for the other side."""

from __future__ import annotations

import threading
from typing import Any


def wait_until_matched(entity: Any, timeout_s: float) -> bool:
    """Waits until a publisher has a subscriber, or a querier somebody to ask; false if there is none in time."""
    matching = threading.Event()
    listener = entity.declare_matching_listener(lambda status: matching.set() if status.matching else None)
    try:
        return bool(entity.matching_status.matching or matching.wait(timeout_s))
    finally:
        # Its thread would keep the process alive.
        listener.undeclare()
