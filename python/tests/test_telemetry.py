"""Topics as iterators, from a worm that really crawls."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import time
from itertools import islice

import pytest
from conftest import Up

import wormd
from wormd import _codes, _topic

LOAD = {wormd.AlarmKind.LINK_FAULT, wormd.AlarmKind.TRACKER_FAULT}
"""Warnings that a busy computer may give."""


def test_states_come_one_by_one(up: Up) -> None:
    with up.worm() as worm, worm.states() as states:
        seen = list(islice(states, 500))
        lost = states.lost
    sequences = [state.sequence for state in seen]
    assert lost is not None
    assert sequences[-1] - sequences[0] == len(seen) - 1 + lost
    assert all(later.time_ns > earlier.time_ns for earlier, later in zip(seen, seen[1:], strict=False))
    assert seen[-1].phase > seen[0].phase
    assert [len(state.position_m) for state in seen] == [4] * len(seen)
    assert {state.mode for state in seen} == {wormd.Mode.CRAWLING}
    assert seen[0].mode == "crawling" and f"{seen[0].mode}" == "crawling"
    with pytest.raises(dataclasses.FrozenInstanceError):
        seen[0].phase = 0.0  # type: ignore[misc]


def test_a_slow_reader_is_told_what_it_lost(up: Up) -> None:
    with up.worm() as worm, worm.states() as states, worm.states() as quick:
        begun = next(states).sequence
        # The buffer holds 1024; a busy computer may take longer for 1500 than one and a half seconds.
        while next(quick).sequence < begun + 1500:
            pass
        states.take()
        assert states.lost is not None and states.lost > 400


def test_each_topic_delivers(up: Up) -> None:
    with up.worm() as worm:
        timing = list(islice(worm.timing(), 100))
        assert len({tick.sequence for tick in timing}) == 100
        estimates = list(islice(worm.estimates(), 20))
        assert estimates[-1].sample > estimates[0].sample
        assert worm.estimates().lost is None, "they are not numbered"
        # The last cycles come at once to who joins late; then the next one.
        cycles = worm.cycles(history=True, timeout=10)
        first, new = next(cycles), next(worm.cycles(timeout=10))
        assert new.end_ns > first.end_ns
        assert 0.004 < new.advance_m < 0.009
        # On a busy computer the first may come too early, and is refused.
        arms = (command for command in worm.commands(history=True, timeout=10) if command.kind == "arm")
        assert any(arm.outcome == wormd.CommandOutcome.ACCEPTED for arm in arms)
        latest = worm.latest()
        assert latest.cycle is not None and latest.cycle.end_ns >= new.end_ns
        assert latest.estimate is not None and latest.range is None
        assert set(latest.raised) <= LOAD
        assert worm.latest().state.sequence > latest.state.sequence


def test_silence_and_absence_are_told_apart(up: Up) -> None:
    with up.worm() as worm:
        begun = time.monotonic()
        with pytest.raises(wormd.Silent, match=r"recording: nothing came for 0\.3 s"):
            next(worm.recording(timeout=0.3))
        assert time.monotonic() - begun < 2
        stream = worm.states()
    with pytest.raises(wormd.WormError, match="closed"):
        next(stream)
    with pytest.raises(wormd.WormError, match="was closed"):
        worm.states()
    with pytest.raises(wormd.NotRunning, match="no worm nobody-there is running: start it with"):
        wormd.Worm("nobody-there")
    with pytest.raises(ValueError, match="no worm's name"):
        wormd.Worm("../x")


def test_a_worm_of_another_version_is_refused(up: Up) -> None:
    class Older(_topic.Memory):
        _fields_ = wormd.State.TOPIC.memory._fields_

        @staticmethod
        def type_name() -> str:
            return "wormd_state_v2"

    topic = dataclasses.replace(wormd.State.TOPIC, memory=Older)
    with up.worm() as worm, pytest.raises(wormd.OtherVersion, match="use the package of the version of wormd that runs"):
        worm._stream(topic, 0, None)


def test_a_code_of_a_newer_version_has_a_name() -> None:
    unknown = wormd.AlarmKind.of(31)
    assert (unknown, unknown.code, unknown is wormd.AlarmKind.of(31)) == ("unknown-31", 31, True)
    assert wormd.alarms_of(0b101) == (wormd.AlarmKind.MOTOR_STALL, wormd.AlarmKind.NO_PROGRESS)
    assert _codes.Code in wormd.Mode.__mro__


def test_status_in_a_few_lines(up: Up) -> None:
    def status(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "wormd", name], capture_output=True, text=True, check=False)

    shown = status(up.name)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.startswith(f"{up.name}: crawling, ")
    assert "\nalarms   " in shown.stdout
    missing = status("nobody-there")
    assert (missing.returncode, missing.stdout) == (1, "")
    assert missing.stderr.startswith("wormd: no worm nobody-there is running")
