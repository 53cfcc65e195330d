"""What a script sees of alarms, restarts and the end of its worm."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest
from conftest import PROGRAM, Up, wait_for

import wormd


def test_a_stream_survives_a_restart_and_reports_the_end(tmp_path: Path) -> None:
    up = Up("restart", tmp_path)
    worm = up.worm()
    alarms, states = worm.alarms(timeout=20), worm.states()
    before = next(states)
    subprocess.run([PROGRAM, "fault", "stall", "--name", up.name], check=True, capture_output=True)
    alarm = next(alarms)
    assert (alarm.kind, alarm.severity, alarm.raised) == (wormd.AlarmKind.MOTOR_STALL, wormd.Severity.CRITICAL, 1)
    fault = worm.wait_for_mode("fault")
    assert (fault.fault, fault.fault_alarm) == (wormd.Fault.ALARM, wormd.AlarmKind.MOTOR_STALL)

    up.end()
    up.start()
    # The same stream goes on with the new controller, whose ticks begin anew.
    states.take()
    after = states.next(timeout=5)
    assert after.time_ns > before.time_ns
    assert worm.latest().state.mode == "crawling"
    assert worm.crawl(0.3).mode == "crawling", "a relay of the new worm is found"

    up.end()
    states.take()
    begun = time.monotonic()
    with pytest.raises(wormd.NotRunning, match="has ended|no worm"):
        states.next()
    assert time.monotonic() - begun < 10
    for command in (worm.hold, worm.stop):
        with pytest.raises(wormd.NotRunning, match="has ended"):
            command()
    with pytest.raises(wormd.NotRunning):
        worm.crawl(0.3)
    worm.close()
    # The relay that the crawl started notices by itself that its worm has ended, and leaves when it does.
    folder = Path("/dev/shm/wormd") / up.name
    wait_for("the last one leaves nothing behind", lambda: not folder.exists())
