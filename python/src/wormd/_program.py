"""Calls of the program ``wormd``."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any

from .errors import ProgramFailed, ProgramNotFound

StrPath = str | os.PathLike[str]

ProgressCallback = Callable[[str, float], None]
"""Is told the stage, and how much of the whole is done, 0 to 1."""

LOG = logging.getLogger("wormd")

_ENVIRONMENT = "WORMD"
_SHOW_AFTER_S = 1.0


def find(given: StrPath | None = None, worm_process: int | None = None) -> str:
    """Find the program: the given one, $WORMD, the one that runs a worm, or the one on the PATH.

    Raises:
        ProgramNotFound: there is none.
    """
    named = given if given is not None else os.environ.get(_ENVIRONMENT)
    if named is not None:
        found = shutil.which(named)
        if found is None:
            raise ProgramNotFound(f"{os.fspath(named)} is no program that can be run")
        return found
    if worm_process is not None:
        with contextlib.suppress(OSError):
            running = os.readlink(f"/proc/{worm_process}/exe")
            if os.access(running, os.X_OK):
                return running
    found = shutil.which("wormd")
    if found is None:
        raise ProgramNotFound(
            "the program wormd is not on the PATH: build it with `cargo build --release --bin wormd`, or name it with "
            f"the environment variable {_ENVIRONMENT} or the argument wormd="
        )
    return found


def call_json(program: StrPath | None, arguments: Sequence[StrPath], progress: ProgressCallback | bool | None = None) -> Any:
    """Call the program, and return the JSON that it prints.

    Raises:
        ProgramFailed: it ended with an error, or printed something else.
    """
    printed = call(program, arguments, progress)[0]
    try:
        return json.loads(printed)
    except json.JSONDecodeError as error:
        raise ProgramFailed(f"wormd {os.fspath(arguments[0])} printed what is no JSON ({error}): {printed[:200]!r}", 0) from error


def call(
    program: StrPath | None, arguments: Sequence[StrPath], progress: ProgressCallback | bool | None = None
) -> tuple[str, list[str]]:
    """Call the program; return what it prints, and its notes.

    Raises:
        ProgramFailed: it ended with an error.
    """
    command = [find(program), *(os.fspath(argument) for argument in arguments)]
    environment = {**os.environ, "WORMD_PROGRESS": "lines"}
    log = _Log(_callback(progress, str(arguments[0])))
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
        encoding="utf-8",
        errors="replace",
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        reader = threading.Thread(target=log.read, args=(process.stderr,), daemon=True)
        reader.start()
        try:
            output = process.stdout.read()
            process.wait()
        except BaseException:
            process.terminate()
            raise
        finally:
            reader.join()
            log.finish()
    if process.returncode != 0:
        raise ProgramFailed(log.failure(process.returncode), process.returncode)
    return output, log.notes


class _Log:
    """What the program writes to its standard error: progress, notes, its log, and at last its failure."""

    def __init__(self, progress: ProgressCallback | None) -> None:
        self.notes: list[str] = []
        self._progress = progress
        self._failure: list[str] = []
        self._lines: list[str] = []

    def read(self, pipe: IO[str]) -> None:
        for line in pipe:
            self._take(line.rstrip("\n"))

    def _take(self, line: str) -> None:
        if line.startswith("progress: "):
            fraction, _, stage = line.removeprefix("progress: ").partition(" ")
            if self._progress is not None:
                self._progress(stage, float(fraction))
            return
        self._lines.append(line)
        if line.startswith("wormd: "):
            self._failure = [line.removeprefix("wormd: ")]
        elif self._failure:
            self._failure.append(line)
        elif line.startswith("note: "):
            self.notes.append(line.removeprefix("note: "))
        else:
            LOG.info("%s", line)

    def failure(self, status: int) -> str:
        """Return the program's last words."""
        lines = self._failure or self._lines[-5:] or [f"wormd ended with status {status}"]
        return "\n".join(lines)

    def finish(self) -> None:
        if isinstance(self._progress, _Bar):
            self._progress.finish()


def _callback(progress: ProgressCallback | bool | None, what: str) -> ProgressCallback | None:
    if progress is False:
        return None
    return _Bar(what) if progress is None or progress is True else progress


class _Bar:
    """Shows progress on standard error once the work takes longer than a second.

    In a terminal that is one line which changes, and elsewhere, as in a notebook, a line for each stage.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._begun = time.monotonic()
        self._stage = ""
        self._is_open = False

    def __call__(self, stage: str, fraction: float) -> None:
        if time.monotonic() - self._begun < _SHOW_AFTER_S:
            return
        if sys.stderr.isatty():
            self._is_open = True
            sys.stderr.write(f"\r\x1b[K{self._what}: {100 * fraction:.0f} %, {stage}")
            sys.stderr.flush()
        elif stage != self._stage:
            print(f"{self._what}: {100 * fraction:.0f} %, {stage}", file=sys.stderr, flush=True)
        self._stage = stage

    def finish(self) -> None:
        if self._is_open:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def existing(path: Path) -> Path | None:
    """Return the path if there is something."""
    return path if path.exists() else None
