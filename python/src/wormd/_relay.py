"""The connection to a worm's relay (docs/relay.md): one thread that says that this script is alive, and reads."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import select
import socket
import subprocess
import threading
import time
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from ._instance import Instance
from ._program import StrPath, find
from .errors import NotDriver, Refused, RelayLost

_VERSION = 1
_ALIVE_S = 0.2
"""How often the relay is told that this script is there; it counts on a driver's word for 0.75 s."""
_START_S = 20.0
"""How long a relay may take to start: cleaning up after a killed worm takes the longest."""
_ANSWER_S = 15.0
"""How long a command may take: arming prepares the servo, and the controller has 5 s for each attempt."""
_MAX_LINE = 32 << 20

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Driver:
    """Who drives a worm."""

    name: str
    """The name that the driver gave: a script's, or that of a screen."""
    user: int
    """User ID."""
    since_s: float
    """For how long, s."""
    attends: bool
    """Whether the worm crawls for as long as this driver is heard."""
    is_me: bool
    """Whether it is this script."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The controller's answer to a command that it accepted."""

    command: str
    """The command."""
    mode: str | None
    """The controller's mode after it."""
    fault: str | None
    """The controller's fault after it."""
    tick: int | None
    """The tick that took it, as `State.sequence`."""


class RelayLink:
    """One connection. Where it is lost, `is_lost` says so, and a new one is made for the next command."""

    def __init__(self, instance: Instance, name: str, program: StrPath | None, config: StrPath | None) -> None:
        self._instance, self._worm = instance, instance.worm
        self._numbers = itertools.count(1)
        self._waiting: dict[int, SimpleQueue[Json]] = {}
        self._lock = threading.Lock()
        self._sending = threading.Lock()
        self._end, self._wake = os.pipe()
        self._reason: str | None = None
        self._watcher: int | None = None
        self._frame: Json | None = None
        self._news = threading.Condition(self._lock)
        self._socket = _connect(instance, program, config)
        self._send({"command": "hello", "version": _VERSION, "name": name})
        self._thread = threading.Thread(target=self._run, name="wormd-relay", daemon=True)
        self._thread.start()

    @property
    def is_lost(self) -> bool:
        """Whether the connection has ended."""
        return self._reason is not None

    def command(self, command: str, **arguments: Any) -> Answer:
        """Give a command, and wait for the answer.

        Raises:
            Refused: it was not accepted.
            NotRunning: the worm has ended.
            RelayLost: the connection ended before the answer; what became of the command is not known.
        """
        number, queue = next(self._numbers), SimpleQueue[Json]()
        with self._lock:
            if self._reason is not None:
                raise RelayLost(self._reason)
            self._waiting[number] = queue
        try:
            self._send({"id": number, "command": command, **arguments})
            answer = queue.get(timeout=_ANSWER_S)
        except OSError as error:
            raise RelayLost(f"{command}: the connection to the relay of {self._worm} was lost ({error})") from error
        except Empty:
            raise RelayLost(f"{command}: the relay of {self._worm} did not answer within {_ANSWER_S:.0f} s") from None
        finally:
            with self._lock:
                self._waiting.pop(number, None)
        verdict = answer.get("verdict")
        if verdict is None:
            raise RelayLost(f"{command}: {answer['lost']}; what became of the command is not known")
        mode, fault = answer.get("mode"), answer.get("fault")
        if verdict == "no-answer":
            self._instance.require_running()
        if verdict != "accepted":
            kind = NotDriver if verdict == "not-driver" else Refused
            raise kind(command, verdict, answer.get("refusal") or "refused", mode, fault)
        self._watcher = answer.get("watcher")
        return Answer(command, mode, fault, answer.get("tick"))

    def driver(self) -> Driver | None:
        """Return who drives, by the next frame: the last one may be older than a command that was answered since."""
        with self._news:
            last = self._frame
            is_new = self._news.wait_for(lambda: self._frame is not last or self._reason is not None, _ANSWER_S)
            if self._reason is not None or not is_new or self._frame is None:
                raise RelayLost(self._reason or f"the relay of {self._worm} sends nothing")
            driver = self._frame.get("driver")
        if driver is None:
            return None
        is_me = driver["watcher"] == self._watcher
        return Driver(driver["name"], driver["user"], driver["since_ms"] / 1e3, driver["attends"], is_me)

    def close(self) -> None:
        """End the connection. A worm that crawls by it holds."""
        with contextlib.suppress(OSError):
            os.write(self._wake, b"x")
        self._thread.join()
        for end in (self._end, self._wake):
            os.close(end)
        self._socket.close()

    def _send(self, request: Json) -> None:
        # The relay reads CLOCK_MONOTONIC, too, and refuses what was asked for too long ago.
        line = json.dumps({**request, "sent_ns": time.monotonic_ns()}).encode() + b"\n"
        with self._sending:
            self._socket.sendall(line)

    def _run(self) -> None:
        try:
            reason = self._serve()
        except (OSError, ValueError, KeyError, TypeError) as error:
            reason = f"the connection to the relay of {self._worm} was lost ({error})"
        with self._lock:
            self._reason = reason
            for queue in self._waiting.values():
                queue.put({"lost": reason})
            self._news.notify_all()
        # Should the relay be there still, it hears at once that nobody drives any more.
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def _serve(self) -> str:
        """Read until the end; returns why it came."""
        buffered = bytearray()
        said = 0.0
        waiting = select.poll()
        waiting.register(self._socket, select.POLLIN)
        waiting.register(self._end, select.POLLIN)
        while True:
            now = time.monotonic()
            if now - said >= _ALIVE_S:
                said = now
                self._send({"command": "alive"})
            # Rounded up: a wait that ends too early would be repeated at once.
            readable = [end for end, _ in waiting.poll(1 + int(1e3 * max(0.0, said + _ALIVE_S - now)))]
            if self._end in readable:
                return "the connection was closed"
            if not readable:
                continue
            received = self._socket.recv(1 << 20)
            if not received:
                return f"the relay of {self._worm} has ended"
            searched = len(buffered)
            buffered += received
            if len(buffered) > _MAX_LINE:
                return f"the relay of {self._worm} sent a line of more than {_MAX_LINE} bytes"
            if buffered.find(b"\n", searched) < 0:
                continue
            *lines, rest = bytes(buffered).split(b"\n")
            buffered = bytearray(rest)
            for line in lines:
                refusal = self._take(json.loads(line))
                if refusal is not None:
                    return refusal

    def _take(self, line: Json) -> str | None:
        """Take a line of the relay; returns why it closes the connection, if it does."""
        if "frame" in line:
            with self._news:
                self._frame = line["frame"]
                self._news.notify_all()
        elif "answer" in line:
            with self._lock:
                queue = self._waiting.get(line["answer"].get("id"))
            if queue is not None:
                queue.put(line["answer"])
        elif "refused" in line:
            return str(line["refused"]["reason"])
        elif "hello" in line and line["hello"]["version"] > _VERSION:
            return f"the relay speaks version {line['hello']['version']}, and this package {_VERSION}: use a newer package"
        return None


@dataclass(frozen=True)
class _Started:
    """A relay that this process has started. It goes on when this process ends."""

    command: list[str]
    process: subprocess.Popen[bytes]


_STARTED: list[_Started] = []
"""Kept so that nobody takes them for forgotten."""


def _connect(instance: Instance, program: StrPath | None, config: StrPath | None) -> socket.socket:
    """Connect to the relay; start one where there is none."""
    begun = time.monotonic()
    started: _Started | None = None
    while True:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connection.connect(os.fspath(instance.folder / "relay.sock"))
            return connection
        except OSError as error:
            connection.close()
            problem = error
        pid = instance.require_running()
        if started is not None and started.process.poll() is not None and instance.holder("relay") is None:
            raise RelayLost(f"the relay of {instance.worm} could not be started: `{' '.join(started.command)}` says why")
        if started is None and instance.holder("relay") is None:
            started = _start(instance, find(program, worm_process=pid), config)
        if time.monotonic() - begun > _START_S:
            raise RelayLost(f"the relay of {instance.worm} did not take this script within {_START_S:.0f} s: {problem}")
        time.sleep(0.01)


def _start(instance: Instance, program: str, config: StrPath | None) -> _Started:
    command = [program, "relay", "--name", instance.worm]
    if config is not None:
        command += ["--config", os.fspath(config)]
    # Neither Ctrl-C nor the end of this script is meant for it.
    null = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=null, stdout=null, stderr=null, start_new_session=True)
    _STARTED.append(_Started(command, process))
    return _STARTED[-1]
