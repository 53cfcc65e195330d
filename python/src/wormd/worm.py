"""A running worm: its telemetry, and its controls."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from ._instance import locate
from ._messages import (
    Alarm,
    AlarmKind,
    BlackBoxStatus,
    CommandRecord,
    Cycle,
    Estimate,
    Inferred,
    Range,
    RecordingStatus,
    State,
    Timing,
    TripStatus,
)
from ._program import StrPath, call_json, find
from ._relay import Answer, Driver, RelayLink
from ._topic import Message, Topic
from .errors import NotRunning, ProgramFailed, Refused, RelayLost, Silent, WormError
from .stream import Ports, Stream

M = TypeVar("M", bound=Message)

_TICK_TIMEOUT_S = 3.0
"""The controller sends a thousand states a second. Longer silence than this is no pause of the computer."""
_JOIN_S = 0.05
"""How often the estimator gives late joiners the last values."""


@dataclass(frozen=True, slots=True)
class Latest:
    """The newest message of each topic that there is one of."""

    state: State
    """The newest tick."""
    estimate: Estimate | None
    """The newest estimate; None without an estimator."""
    cycle: Cycle | None
    """The newest finished gait cycle."""
    range: Range | None
    """How far the battery lasts; None without a configured battery."""

    @property
    def raised(self) -> tuple[AlarmKind, ...]:
        """The alarms that are raised."""
        return () if self.estimate is None else alarms_of(self.estimate.raised_mask)


class Worm:
    """A worm that runs on this computer, started by whomever.

    Args:
        name: its name; without it the configuration's, or ``worm1``.
        config: the worm's configuration file. Needed where it sets ``topics.root``, and for a relay that shall know the
            worm's design.
        sender: how this script is called, where others are told who drives and in the record of commands. Without it the
            name of the script's file.
        wormd: the program, if it is neither on the PATH nor in the environment variable WORMD. Without any of them, the one
            that runs the worm.

    Raises:
        NotRunning: there is no such worm.

    Nothing is opened before it is used: who only reads topics starts no relay, and who only gives commands reads no topics.
    A worm may be used from several threads; each stream belongs to the thread that made it.

    **A crawl lasts as long as the script.** Commands go by the worm's relay, as those of ``wormd watch`` do. It permits a
    crawl for a second at a time while this script is heard; when the script ends, however it ends, the worm holds. Leaving
    the ``with`` block, or `close`, ends the script's part in the same way.
    """

    def __init__(
        self,
        name: str | None = None,
        *,
        config: StrPath | None = None,
        sender: str | None = None,
        wormd: StrPath | None = None,
    ) -> None:
        self._instance = locate(name, config)
        self._instance.require_running()
        self._config, self._program = config, wormd
        self._sender = sender or os.path.basename(sys.argv[0] or "python")
        self._ports: Ports | None = None
        self._streams: weakref.WeakSet[Stream[Message]] = weakref.WeakSet()
        self._latest: _LatestReader | None = None
        self._relay: RelayLink | None = None
        self._lock = threading.RLock()
        self._is_closed = False

    @property
    def name(self) -> str:
        """Its name."""
        return self._instance.worm

    @property
    def is_running(self) -> bool:
        """Whether it has a controller at present."""
        return self._instance.holder("controller") is not None

    def states(self, *, timeout: float | None = _TICK_TIMEOUT_S) -> Stream[State]:
        """Iterate over the states, one each tick, woken by each."""
        return self._stream(State.TOPIC, 0, timeout)

    def timing(self, *, timeout: float | None = _TICK_TIMEOUT_S) -> Stream[Timing]:
        """Iterate over how long each tick took, a few ticks at a time."""
        return self._stream(Timing.TOPIC, 0, timeout)

    def estimates(self, *, timeout: float | None = _TICK_TIMEOUT_S) -> Stream[Estimate]:
        """Iterate over the estimator's results, one for each tracker sample. They are not numbered, so none is counted as lost."""
        return self._stream(Estimate.TOPIC, 0, timeout)

    def cycles(self, *, history: bool = False, timeout: float | None = None) -> Stream[Cycle]:
        """Iterate over the gait cycles as they end; with `history`, over the last 16 first."""
        return self._stream(Cycle.TOPIC, Cycle.TOPIC.history if history else 0, timeout)

    def alarms(self, *, history: bool = True, timeout: float | None = None) -> Stream[Alarm]:
        """Iterate over alarms as they are raised and cleared, woken at once; with `history`, over the last 32 changes first."""
        return self._stream(Alarm.TOPIC, Alarm.TOPIC.history if history else 0, timeout)

    def range(self, *, timeout: float | None = None) -> Stream[Range]:
        """Iterate over how far the battery lasts: after each gait cycle, where a battery is configured."""
        return self._stream(Range.TOPIC, Range.TOPIC.history, timeout)

    def inferred(self, *, timeout: float | None = None) -> Stream[Inferred]:
        """Iterate over what the motor's current alone says: after each gait cycle, once it is fitted, and after each mark."""
        return self._stream(Inferred.TOPIC, Inferred.TOPIC.history, timeout)

    def commands(self, *, history: bool = False, timeout: float | None = None) -> Stream[CommandRecord]:
        """Iterate over the commands that the controller took or refused, whoever sent them."""
        return self._stream(CommandRecord.TOPIC, CommandRecord.TOPIC.history if history else 0, timeout)

    def recording(self, *, timeout: float | None = None) -> Stream[RecordingStatus]:
        """Iterate over how the recorder is doing, once a second, while there is one."""
        return self._stream(RecordingStatus.TOPIC, RecordingStatus.TOPIC.history, timeout)

    def black_box(self, *, timeout: float | None = None) -> Stream[BlackBoxStatus]:
        """Iterate over how the black box is doing, once a second, while there is one."""
        return self._stream(BlackBoxStatus.TOPIC, BlackBoxStatus.TOPIC.history, timeout)

    def trip(self, *, timeout: float | None = None) -> Stream[TripStatus]:
        """Iterate over how a trip is doing, twice a second and on change, while there is one."""
        return self._stream(TripStatus.TOPIC, TripStatus.TOPIC.history, timeout)

    def latest(self, *, timeout: float = _TICK_TIMEOUT_S) -> Latest:
        """Return the newest messages. Use it in one thread.

        Raises:
            Silent: the worm has not sent a state for so long.
        """
        with self._lock:
            if self._latest is None:
                self._latest = _LatestReader(self)
        return self._latest.read(timeout)

    def driver(self) -> Driver | None:
        """Return who drives: who gave the first command, or took over."""
        return self._linked().driver()

    def arm(self) -> Answer:
        """Switch torque on.

        Raises:
            Refused: with verdict and reason, as for all commands.
        """
        return self._linked().command("arm")

    def crawl(self, cycles_per_s: float | None = None) -> Answer:
        """Crawl with this speed, or with the configured one, for as long as this script lives and nobody says otherwise.

        Args:
            cycles_per_s: gait cycles per second; negative goes backward. A second call changes the speed.

        Raises:
            NotDriver: somebody else drives; the reason has the name.
            Refused: the controller does not crawl; the reason says why.
        """
        if cycles_per_s is None:
            return self._linked().command("crawl")
        speed = float(cycles_per_s)
        if not 0 < abs(speed) < float("inf"):
            raise ValueError(f"{speed} is no speed: give gait cycles per second other than 0; `hold` stands still")
        return self._linked().command("crawl", cycles_per_s=speed)

    def hold(self) -> Answer:
        """Keep the cam where it is, with torque. Anyone may, whoever drives, and also without a relay."""
        try:
            return self._linked().command("hold")
        except (RelayLost, WormError) as error:
            return self._without_relay("hold", error)

    def stop(self) -> Answer:
        """Ramp down, then torque off. Works in every mode, and also without a relay.

        Raises:
            NotDriver: somebody else drives. Anyone may `hold`; ``wormd command stop`` stops whoever drives.
        """
        try:
            return self._linked().command("stop")
        except (RelayLost, WormError) as error:
            return self._without_relay("stop", error)

    def reset(self) -> Answer:
        """Leave the fault, armed from the measured position; or permit motion despite the alarms that stand."""
        return self._linked().command("reset")

    def acknowledge(self, alarms: Iterable[AlarmKind | str] = ()) -> Answer:
        """Note that somebody has seen these alarms, or all. Permits nothing."""
        return self._linked().command("acknowledge", alarms=[str(alarm) for alarm in alarms])

    def mark(self, position_m: float, sigma_m: float | None = None) -> Answer:
        """Say where the mean of the cells is along the canal, for the dead reckoning. Moves and permits nothing."""
        known = {} if sigma_m is None else {"sigma_m": sigma_m}
        return self._linked().command("mark", position_m=position_m, **known)

    def take_over(self) -> Answer:
        """Drive, whoever did. A crawl goes on, and lasts as long as this script from now on."""
        return self._linked().command("take_over")

    def wait_for_mode(self, *modes: str, timeout: float = 10.0) -> State:
        """Wait until the controller is in one of these modes, and return the state.

        Raises:
            Silent: it was not within the time.
        """
        begun = time.monotonic()
        with self.states() as states:
            for state in states:
                if state.mode in modes:
                    return state
                if time.monotonic() - begun > timeout:
                    break
        raise Silent(f"{self.name} is {state.mode}, not {' or '.join(modes)}, after {timeout:g} s")

    def record(self, out: StrPath, *, topics: Iterable[str] = (), force: bool = False) -> Recorder:
        """Record the worm into an MCAP file, by ``wormd record``, until the ``with`` block ends.

        Args:
            out: the file.
            topics: only these; the commands are always recorded.
            force: replace a file that is there.
        """
        command = [find(self._program, self._instance.holder("controller")), "record", "--end-with-stdin", "--name", self.name]
        command.append(f"--out={os.fspath(out)}")
        if self._config is not None:
            command.append(f"--config={os.fspath(self._config)}")
        if names := ",".join(topics):
            command += ["--topics", names]
        if force:
            command.append("--force")
        return Recorder(command, Path(out))

    def close(self) -> None:
        """End this script's part: streams end, and a worm that crawls by this script holds."""
        with self._lock:
            self._is_closed = True
            relay, self._relay = self._relay, None
            if relay is not None:
                relay.close()
            for stream in list(self._streams):
                stream.close()
            ports, self._ports = self._ports, None
            if ports is not None:
                ports.close()

    def __enter__(self) -> Worm:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Worm({self.name!r})"

    def _stream(self, topic: Topic[M], history: int, timeout: float | None) -> Stream[M]:
        with self._lock:
            self._require_open()
            if self._ports is None:
                self._ports = Ports(self._instance)
            stream = Stream(self._ports, topic, history, timeout)
            self._streams.add(stream)  # type: ignore[arg-type]
            return stream

    def _linked(self) -> RelayLink:
        with self._lock:
            self._require_open()
            if self._relay is not None and self._relay.is_lost:
                self._relay.close()
                self._relay = None
            if self._relay is None:
                self._relay = RelayLink(self._instance, self._sender, self._program, self._config)
            return self._relay

    def _require_open(self) -> None:
        if self._is_closed:
            raise WormError(f"{self.name} was closed: make a new Worm")

    def _without_relay(self, command: str, error: WormError) -> Answer:
        if isinstance(error, Refused) or self._is_closed:
            raise error
        if self._instance.holder("controller") is None:
            raise NotRunning(f"{self.name} has ended: there is nothing left to {command}") from error
        arguments = ["command", command, "--json", "--name", self.name]
        if self._config is not None:
            arguments.append(f"--config={os.fspath(self._config)}")
        program = find(self._program, self._instance.holder("controller"))
        try:
            answer = call_json(program, arguments, progress=False)
        except ProgramFailed as failure:
            raise failure from error
        return Answer(command, answer.get("mode"), answer.get("fault"), answer.get("tick"))


class Recorder:
    """``wormd record`` while a ``with`` block lasts. The log is complete when the block has ended, or the script, however it ends."""

    path: Path
    """The log."""

    def __init__(self, command: list[str], path: Path) -> None:
        self.path = path
        pipe = subprocess.PIPE
        # Ctrl-C ends the script, and the end of its pipe the recorder.
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
        assert self._process.stdout is not None
        if self._process.stdout.readline() != "ready\n":
            self._finish()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the recording.

        Raises:
            ProgramFailed: it could not be written to the end, or ended before; the text says why.
        """
        if self._process.returncode is None:
            self._finish()

    def _finish(self) -> None:
        _, log = self._process.communicate()  # closes its standard input
        if self._process.returncode != 0:
            raise ProgramFailed(log.strip().removeprefix("wormd: "), self._process.returncode)


class _LatestReader:
    """Keeps the newest message of some topics."""

    def __init__(self, worm: Worm) -> None:
        self._states = worm.states()
        self._estimates = worm.estimates()
        self._cycles = worm.cycles(history=True)
        self._range = worm.range()
        self._estimate: Estimate | None = None
        self._cycle: Cycle | None = None
        self._newest_range: Range | None = None
        # Late joiners get the last values of the rarely written topics within 50 ms.
        time.sleep(2 * _JOIN_S)

    def read(self, timeout: float) -> Latest:
        state = self._states.newest() or self._states.next(timeout)
        self._estimate = self._estimates.newest() or self._estimate
        self._cycle = self._cycles.newest() or self._cycle
        self._newest_range = self._range.newest() or self._newest_range
        return Latest(state, self._estimate, self._cycle, self._newest_range)


def alarms_of(mask: int) -> tuple[AlarmKind, ...]:
    """Return the alarms whose bits are set in a mask such as `Estimate.raised_mask`."""
    return tuple(AlarmKind.of(code) for code in range(mask.bit_length()) if mask >> code & 1)
