"""Threads that do not keep a process alive, and what is closed at its end."""

from __future__ import annotations

import atexit
import logging
import threading
import weakref
from typing import Any, Callable

#: How long a process that ends waits for sessions that were not closed, and for what is pending in them (s).
EXIT_S = 5.0

_open: weakref.WeakSet[Any] = weakref.WeakSet()
_ending, _ended, _starting = threading.Event(), threading.Event(), threading.Lock()
_closer: threading.Thread | None = None


def for_each(messages: Any, work: Callable[[Any], Any], name: str) -> threading.Thread:
    """Hands over every message of a subscriber or queryable until it is undeclared; Zenoh's own threads for callbacks are no daemons."""

    def run() -> None:
        for message in messages:
            work(message)

    return start(run, name)


def start(run: Callable[[], Any], name: str) -> threading.Thread:
    """Starts a daemon."""
    thread = threading.Thread(target=run, name=f"isotherm {name}", daemon=True)
    thread.start()
    return thread


def close_at_exit(session: Any) -> None:
    """Has `session` closed when the process ends."""
    global _closer
    with _starting:
        _open.add(session)
        # Closing may take longer than is waited for. At the end of the process itself no thread can be started.
        _closer = _closer or start(_close, "exit")


def _close() -> None:
    _ending.wait()
    for session in list(_open):
        try:
            session.close()
        except Exception:
            logging.getLogger("isotherm").exception("a session cannot be closed")
    _ended.set()


@atexit.register
def _exit() -> None:
    _ending.set()
    if _closer is not None:
        _ended.wait(EXIT_S)
