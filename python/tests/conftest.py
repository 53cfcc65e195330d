"""Real worms for the tests: `wormd up` with the virtual worm, under names that nothing else has.

The binary is that of the environment variable WORMD, or the one on the PATH.
"""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import wormd
from wormd import _program

PATIENCE_S = 30.0
PROGRAM = _program.find()

CONFIG = """
[servo]
watchdog_ms = 2000
[control]
link_timeout_s = 2.0
tracker_timeout_s = 5.0
estimator_timeout_s = 5.0
lease_s = 10.0
"""
"""A computer that runs tests may keep a worm waiting, which is not what they are about."""


def wait_for(what: str, condition: Callable[[], object]) -> None:
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < PATIENCE_S, f"not within {PATIENCE_S} s: {what}"
        time.sleep(0.02)


class Up:
    """A virtual worm that crawls by `wormd up`."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = f"{name}-{os.getpid() % 100_000}"
        self.folder = folder
        self.config = folder / "worm.toml"
        self.config.write_text(CONFIG)
        self.process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        log = (self.folder / f"{self.name}.log").open("ab")
        command = [PROGRAM, "up", "--plain", "--allow-faults", "--name", self.name, "--config", str(self.config)]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        wait_for(f"{self.name} crawls", self.is_crawling)

    def is_crawling(self) -> bool:
        assert self.process is not None and self.process.poll() is None, (self.folder / f"{self.name}.log").read_text()
        try:
            with self.worm() as worm:
                return worm.latest().state.mode == wormd.Mode.CRAWLING
        except wormd.WormError:
            return False

    def worm(self, sender: str = "test") -> wormd.Worm:
        return wormd.Worm(self.name, sender=sender)

    def make_crawl(self) -> None:
        """Make it crawl again by its own supervisor's lease, whatever the last test left."""
        with self.worm() as worm:
            if worm.latest().state.mode == wormd.Mode.FAULT:
                wait_for("the fault is over", functools.partial(self._command, "reset"))
        for command in ("stop", "arm", "crawl"):
            wait_for(f"{command} is accepted", functools.partial(self._command, command))
        wait_for(f"{self.name} crawls", self.is_crawling)

    def _command(self, command: str) -> bool:
        command_line = [PROGRAM, "command", command, "--name", self.name, "--config", str(self.config)]
        done = subprocess.run(command_line, capture_output=True, check=False)
        return done.returncode == 0

    def end(self) -> None:
        if self.process is not None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(PATIENCE_S)
            self.process = None


@pytest.fixture
def up(session_worm: Up) -> Up:
    """Return a worm that crawls, whatever the last test left."""
    if not session_worm.is_crawling():
        session_worm.make_crawl()
    return session_worm


@pytest.fixture(scope="session")
def session_worm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Up]:
    worm = Up("pytest", tmp_path_factory.mktemp("up"))
    yield worm
    worm.end()


@pytest.fixture
def script(up: Up) -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Start a script with a `worm` that is called "script"; it is killed when the test ends."""
    started = []

    def start(text: str) -> subprocess.Popen[str]:
        # As in a terminal, also where the tests run in the background: there Ctrl-C is ignored, and Python keeps that.
        head = "import signal, time, wormd\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        head += f"worm = wormd.Worm({up.name!r}, sender='script')\n"
        process = subprocess.Popen([sys.executable, "-c", head + text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()
