"""The session with a service or router: streams, producers, and what operators ask."""

from __future__ import annotations

import json
import math
import os
import pathlib
import time
from types import TracebackType
from typing import Any, Callable

import zenoh

from . import _layout as layout
from ._arrays import CorrectedBatch
from ._match import wait_until_matched
from ._producer import Producer
from ._rules import Message, Refused
from ._stream import CorrectedStream, StatusStream
from ._threads import close_at_exit, for_each
from ._wire import decode, encode

#: Where a service listens by default.
ENDPOINT = "tcp/127.0.0.1:7447"
#: How long a service may take to answer where the connection was waited for without end (s).
_ANSWER_S = 10.0
# How long one trial of a connection takes: meanwhile Ctrl-C is not heard. How long the others of several may take after the first.
_TRIAL_S = 1.0
_OTHERS_S = 0.5
_ESCAPED = {character: f"%{ord(character):02X}" for character in ";=%?#&|"}


class BusError(RuntimeError):
    """Nobody answers, or the answer is that it cannot be done."""


class NotAccepted(BusError):
    """A service refused a calibration or a command; `reply` is its whole answer."""

    def __init__(self, words: str, reply: Message) -> None:
        super().__init__(words)
        self.reply = reply


def connect(
    *endpoints: str,
    namespace: str | None = None,
    config: zenoh.Config | None = None,
    timeout_s: float | None = 10.0,
    name: str | None = None,
) -> Bus:
    """Opens a session with the service or router at an endpoint (default: the environment's ISOTHERM_CONNECT, else `ENDPOINT`), or with
    each of several; `host:port` is TCP. Use it in a `with` statement.

    Tries again until one answers; raises `BusError` if none does within `timeout_s` (None: waits for ever). A connection that is lost, or
    one of several that is not there yet, is tried again for as long as the session is open; streams and producers then go on.
    Nothing is searched for on the network. `config` replaces the configuration altogether. `name` is the common name of your
    certificate, where access control asks for one: swaps and commands are given under it.
    """
    stated = endpoints or tuple(filter(None, map(str.strip, os.environ.get("ISOTHERM_CONNECT", "").split(",")))) or (ENDPOINT,)
    endpoints = tuple(endpoint if "/" in endpoint else f"tcp/{endpoint}" for endpoint in stated)
    deadline = math.inf if timeout_s is None else time.monotonic() + timeout_s
    while True:
        error = ""
        try:
            session = zenoh.open(config or _config(endpoints, namespace, min(deadline - time.monotonic(), _TRIAL_S)))
            if config is not None or _is_connected(session, len(endpoints), deadline):
                return Bus(session, _ANSWER_S if timeout_s is None else timeout_s, name)
            session.close()
        except zenoh.ZError as raised:
            error = f" ({raised})"
        if config is not None or time.monotonic() >= deadline:
            words = " or ".join(endpoints) if config is None else "the configuration's endpoints"
            limit = "" if timeout_s is None else f" within {timeout_s:g} s"
            raise BusError(f"{words}: no service or router answers{limit}; is it running there?{error}")


def _config(endpoints: tuple[str, ...], namespace: str | None, timeout_s: float) -> zenoh.Config:
    """Of a client, which has one connection, or of a peer with several, of which one is enough."""
    config = zenoh.Config()
    is_client = len(endpoints) == 1
    options: dict[str, Any] = {
        "mode": "client" if is_client else "peer",
        "listen/endpoints": [] if is_client else ["tcp/127.0.0.1:0"],
        "connect/endpoints": list(endpoints),
        "connect/timeout_ms": max(1, int(timeout_s * 1000)) if is_client else -1,
        "connect/exit_on_failure": is_client,
        # Zenoh's own 1 s to 4 s would be the pause after a restart of the service.
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2.0},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/queue/batching/time_limit": 0,
    }
    if namespace is not None:
        options["namespace"] = namespace
    for key, value in options.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _is_connected(session: zenoh.Session, most: int, deadline: float) -> bool:
    """Waits for one connection, then for the others a moment; Zenoh tells nobody of them."""
    others = min(deadline, time.monotonic() + _OTHERS_S)
    while True:
        count = len(session.info.peers_zid()) + len(session.info.routers_zid())
        if count >= most or time.monotonic() >= (others if count > 0 else deadline):
            return count > 0
        time.sleep(0.005)


class Bus:
    """A session. Closing it ends its streams and producers; the end of the process closes what is open, within `EXIT_S`."""

    def __init__(self, session: zenoh.Session, timeout_s: float = 10.0, name: str | None = None) -> None:
        #: The Zenoh session, for anything else.
        self.session = session
        self.timeout_s = timeout_s
        self._named = "" if name is None else f"/{name}"
        self._parts: list[CorrectedStream | StatusStream | Producer] = []
        # A service that stops asks whether all has arrived; ending its query without a reply says so.
        receipts = session.declare_queryable(f"isotherm/{session.zid()}/receipt")
        for_each(receipts, lambda query: query.drop(), "receipts")
        close_at_exit(self)

    def __enter__(self) -> Bus:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the producers, all streams and the session."""
        for part in sorted(self._parts, key=lambda part: not isinstance(part, Producer)):
            part.close()
        self.session.close()

    def corrected(
        self,
        unit: str = "*",
        *,
        first_wins: bool = True,
        callback: Callable[[CorrectedBatch], Any] | None = None,
        most_waiting: int | None = None,
        timeout_s: float | None = None,
    ) -> CorrectedStream:
        """Corrected batches of a unit, or of all: iterate over it, or give a `callback`, which is called on a thread of its own. What it
        raises is logged with its traceback (logger `isotherm`), counted in `errors`, and the stream goes on.

        From the return on nothing is missed: it waits until the service has answered (`BusError` otherwise). Of two services of a
        unit, `first_wins` uses each tick once. At most `most_waiting` messages wait (default: as many as fit memory); then the oldest
        is dropped, counted in `messages_dropped`, and its ticks show as lost. After `timeout_s` without a message the iteration raises
        `TimeoutError`.
        """
        stream = CorrectedStream(self.session, f"imu/{unit}/corrected", first_wins, callback, most_waiting, timeout_s)
        self._keep(stream)
        self._wait_for_service()
        return stream

    def status_stream(self, unit: str = "*", *, timeout_s: float | None = None) -> StatusStream:
        """Status messages as they are published: on every change and once a second."""
        stream = StatusStream(self.session, f"imu/{unit}/status", timeout_s)
        self._keep(stream)
        return stream

    def producer(
        self,
        unit: str,
        *,
        batch_ticks: int = 1,
        max_in_flight: int | None = None,
        series: int | None = None,
    ) -> Producer:
        """Publishes the raw ticks of a unit; see `Producer`."""
        producer = Producer(self.session, unit, batch_ticks, max_in_flight, series, self.timeout_s)
        self._keep(producer)
        return producer

    def reference(self, unit: str, start_ns: int, end_ns: int, rate_rad_per_s: list[float], sigma_rad_per_s: float) -> None:
        """Publishes the true mean rate of a unit over a span, for its drift estimator."""
        message = {
            "start_ns": start_ns,
            "end_ns": end_ns,
            "angular_rate_rad_per_s": [float(rate) for rate in rate_rad_per_s],
            "sigma_rad_per_s": float(sigma_rad_per_s),
        }
        frame = encode(message, layout.REFERENCE)
        congestion, priority = zenoh.CongestionControl.BLOCK, zenoh.Priority.REAL_TIME
        self.session.put(f"imu/{unit}/reference", frame, congestion_control=congestion, priority=priority)

    def status(self, unit: str = "*") -> dict[str, Message]:
        """Status of a unit, or of all, by serial; with the field names of docs/wire.md. `BusError` for a unit nobody knows."""
        found = {}
        for payload in self._ask(f"imu/{unit}/status"):
            message = decode(payload, layout.STATUS)
            found[message["unit"]] = message
        if not found and unit != "*":
            raise BusError(f"{unit}: no service knows this unit")
        return found

    def services(self) -> dict[str, Message]:
        """Status of every service, by instance."""
        messages = [decode(payload, layout.SERVICE_STATUS) for payload in self._ask("isotherm/*/status")]
        return {message["instance"]: message for message in messages}

    def calibration(self, unit: str) -> str:
        """Text of the calibration document in force."""
        return self._one(f"imu/{unit}/calibration{self._named}", None).decode("utf-8")

    def swap(
        self,
        unit: str,
        document: str | pathlib.Path,
        *,
        by: str | None = None,
        dry_run: bool = False,
        at_sequence: int | None = None,
        at_time_ns: int | None = None,
        slew_s: float | None = None,
        any_serial: bool = False,
        force: bool = False,
    ) -> Message:
        """Gives a unit a calibration document or overlay: its text, or the path of its file. The swap reply of docs/wire.md.

        Raises `NotAccepted` with every problem if the service refuses it.
        """
        text = document.read_text(encoding="utf-8") if isinstance(document, pathlib.Path) else document
        given: dict[str, Any] = {"by": by, "at_sequence": at_sequence, "at_time_ns": at_time_ns, "slew_s": slew_s}
        options = {name: str(value) for name, value in given.items() if value is not None}
        switches = {"dry_run": dry_run, "any_serial": any_serial, "force": force}
        options.update({name: "true" for name, on in switches.items() if on})
        escaped = {name: "".join(_ESCAPED.get(c, c) for c in value) for name, value in options.items()}
        parameters = ";".join(f"{name}={value}" for name, value in escaped.items())
        key = f"imu/{unit}/calibration{self._named}"
        reply = self._json(f"{key}?{parameters}" if parameters else key, text)
        if reply["outcome"] == "refused":
            # As the operator's program prints them, for a document without a file.
            problems = [
                ": ".join(filter(None, [f"{it['line']}:{it['column']}", it.get("key"), it["message"]]))
                for it in reply["problems"]
            ]
            raise NotAccepted(f"{unit}: the calibration is refused: {'; '.join(problems) or 'no reason given'}", reply)
        return reply

    def command(self, unit: str, command: str, *, by: str | None = None, **fields: Any) -> Message:
        """Gives a unit a command with its fields, e.g. `command("ZLG-0001", "run", reversal=True)`. The command reply.

        Raises `NotAccepted` if the service refuses it.
        """
        order = {"command": command, **({} if by is None else {"by": by}), **fields}
        reply = self._json(f"imu/{unit}/command{self._named}", json.dumps(order))
        if not reply["accepted"]:
            raise NotAccepted(f"{unit}: {reply.get('reason') or reply}", reply)
        return reply

    def history(self, unit: str, limit: int = 20) -> list[Message]:
        """What was done to a unit, newest last."""
        entries = json.loads(self._one(f"imu/{unit}/history?limit={limit}", None))
        return list(entries)

    def wait_for_receipts(self, timeout_s: float | None = None) -> None:
        """Waits until every subscriber that gives receipts has taken what this session has published. Raises `BusError`."""
        limit = self.timeout_s if timeout_s is None else timeout_s
        wait_for_receipts(self.session, limit)

    def _keep(self, part: CorrectedStream | StatusStream | Producer) -> None:
        self._parts = [*(other for other in self._parts if not other.closed), part]

    def _ask(self, selector: str, payload: str | None = None, priority: zenoh.Priority | None = None) -> list[bytes]:
        """Every answer to a query; `BusError` for one that is an error."""
        replies = self.session.get(
            selector,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=self.timeout_s,
            payload=payload,
            priority=priority,
        )
        answers, refusal = [], None
        for reply in replies:
            if reply.ok is None:
                refusal = "nobody answers" if reply.err is None else reply.err.payload.to_string()
            else:
                answers.append(reply.ok.payload.to_bytes())
        # Of a pair one may have done what the other does not know of.
        if refusal is not None and not answers:
            raise BusError(f"{selector}: {refusal}")
        return answers

    def _one(self, selector: str, payload: str | None) -> bytes:
        answers = self._ask(selector, payload)
        if not answers:
            raise BusError(f"{selector}: no service answers; does one know the unit? (isotherm status)")
        return answers[0]

    def _json(self, selector: str, payload: str) -> Message:
        reply = json.loads(self._one(selector, payload))
        if not isinstance(reply, dict):
            raise Refused(f"{selector}: the reply is no JSON object")
        return reply

    def _wait_for_service(self) -> None:
        """After the service has answered a query it knows of every subscription that was made before."""
        querier = self.session.declare_querier(
            "imu/*/status",
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=self.timeout_s,
        )
        if not wait_until_matched(querier, self.timeout_s):
            raise BusError(f"no service answers on imu/*/status within {self.timeout_s:g} s; is one connected here?")
        for _ in querier.get():
            pass  # Status of the units that there are already; the end of the replies is the answer.
        querier.undeclare()


def wait_for_receipts(session: zenoh.Session, timeout_s: float) -> None:
    """See `Bus.wait_for_receipts`."""
    replies = session.get(
        "isotherm/*/receipt",
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        timeout=timeout_s,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.REAL_TIME,
        allowed_destination=zenoh.Locality.REMOTE,
    )
    # It ends once everybody has let it go; Zenoh replies with an error for those who have not in time.
    if any(reply.ok is None for reply in replies):
        raise BusError(f"not every subscriber has taken what was published within {timeout_s:g} s")
