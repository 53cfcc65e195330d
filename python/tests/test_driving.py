"""Commands: one drives, anyone may halt, and no crawl outlives its script."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator

import pytest
from conftest import Up, wait_for

import wormd

HOLD_S = 1.25
"""A crawl is permitted for a second at a time; a busy computer gets a quarter more."""

Script = Callable[[str], "subprocess.Popen[str]"]

CRAWL = "worm.crawl(0.3)\nprint('crawls', flush=True)\ntime.sleep(60)"


@pytest.fixture(autouse=True)
def crawling(up: Up) -> Iterator[None]:
    yield
    up.make_crawl()


def start(script: Script, text: str) -> subprocess.Popen[str]:
    process = script(text)
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line == "crawls\n", line + process.communicate()[1]
    return process


def seconds_to_hold(up: Up, ending: Callable[[], object]) -> float:
    """How long after `ending` the worm holds, by the worm's own clock."""
    with up.worm() as worm:
        assert worm.wait_for_mode("crawling").goal_velocity_rad_s > 0
        begun_ns = time.monotonic_ns()
        ending()
        state = worm.wait_for_mode("holding")
    assert state.hold_reason in ("command", "time-limit")
    seconds = (state.time_ns - begun_ns) * 1e-9
    print(f"holds {seconds:.3f} s after it, for {state.hold_reason}")
    return seconds


def test_a_crawl_ends_with_its_block(up: Up) -> None:
    with up.worm() as worm:
        answer = worm.crawl(0.2)
        assert (answer.command, answer.mode, answer.fault) == ("crawl", "crawling", "none")
        driver = worm.driver()
        assert driver is not None and (driver.name, driver.is_me, driver.attends) == ("test", True, True)
        wait_for("the speed is the commanded one", lambda: abs(worm.latest().state.goal_velocity_rad_s - 1.2566) < 1e-3)
        time.sleep(1.5)  # longer than a crawl is permitted at a time
        assert worm.latest().state.mode == "crawling"
        assert worm.crawl(-0.2).mode == "crawling"
    with up.worm() as worm:
        assert worm.wait_for_mode("holding").hold_reason == "command"


def test_a_killed_script_leaves_a_worm_that_holds(up: Up, script: Script) -> None:
    process = start(script, CRAWL)
    assert seconds_to_hold(up, process.kill) < HOLD_S


def test_ctrl_c_leaves_a_worm_that_holds(up: Up, script: Script) -> None:
    process = start(script, f"with worm:\n  {CRAWL.replace(chr(10), chr(10) + '  ')}")
    assert seconds_to_hold(up, lambda: process.send_signal(signal.SIGINT)) < HOLD_S
    assert process.wait(5) == -signal.SIGINT


def test_ctrl_c_interrupts_a_wait_for_an_event(script: Script) -> None:
    process = script("print('crawls', flush=True)\nfor alarm in worm.alarms(): print(alarm)")
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=5)
    assert "KeyboardInterrupt" in error, error


def test_a_frozen_script_leaves_a_worm_that_holds(up: Up, script: Script) -> None:
    process = start(script, CRAWL)
    assert seconds_to_hold(up, lambda: process.send_signal(signal.SIGSTOP)) < 0.75 + HOLD_S


def test_a_killed_relay_leaves_a_worm_that_holds_and_the_next_command_finds_another(up: Up) -> None:
    with up.worm() as worm:
        worm.crawl(0.3)
        relay = worm._instance.holder("relay")
        assert relay is not None
        assert seconds_to_hold(up, lambda: os.kill(relay, signal.SIGKILL)) < HOLD_S
        assert worm.crawl(0.3).mode == "crawling"
        assert worm._instance.holder("relay") not in (None, relay)


def test_one_drives_and_anyone_may_halt(up: Up, script: Script) -> None:
    start(script, CRAWL)
    with up.worm() as worm:
        with pytest.raises(wormd.NotDriver, match="script drives since") as refused:
            worm.crawl(0.1)
        assert (refused.value.command, refused.value.verdict) == ("crawl", "not-driver")
        driver = worm.driver()
        assert driver is not None and (driver.name, driver.is_me) == ("script", False)
        assert worm.hold().mode == "holding"
        worm.take_over()
        assert worm.crawl(0.3).mode == "crawling"
        record = next(record for record in worm.commands(history=True, timeout=5) if record.kind == "hold" and record.sender == "test")
        assert record.outcome == "accepted"


def test_refusals_have_a_verdict_and_a_reason(up: Up) -> None:
    with up.worm() as worm:
        with pytest.raises(wormd.Refused) as refused:
            worm.arm()
        assert (refused.value.verdict, refused.value.mode) == ("wrong-mode", "crawling")
        assert "crawling" in refused.value.reason
        with pytest.raises(wormd.Refused) as refused:
            worm.crawl(100)
        assert refused.value.verdict == "bad-speed"
        with pytest.raises(wormd.Refused, match="mood"):
            worm.acknowledge(["mood"])
        for no_speed in (0.0, float("nan"), float("inf")):
            with pytest.raises(ValueError, match="no speed"):
                worm.crawl(no_speed)
        worm.acknowledge([wormd.AlarmKind.MOTOR_STALL])
        worm.acknowledge()
        worm.stop()
        worm.wait_for_mode("disarmed")
        assert worm.arm().mode in ("armed", "disarmed")
        worm.wait_for_mode("armed")
