"""Who has a role of a worm, by its lock file."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from wormd._instance import Instance
from wormd.errors import NotRunning

HOLDER = """
import os, sys
lock = open(sys.argv[1], "w")
lock.write(f"{os.getpid()}\\na note\\n")
lock.flush()
print("has it", flush=True)
# The lowest number that is free comes before that of the lock in the list of what is open.
os.close(0)
while True:
    os.close(os.open("/dev/null", os.O_RDONLY))
"""


@contextmanager
def held(instance: Instance, role: str) -> Iterator[subprocess.Popen[str]]:
    """Run a process that has a role."""
    instance.folder.mkdir()
    arguments = [sys.executable, "-c", HOLDER, str(instance.folder / f"{role}.lock")]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as holder:
        try:
            assert holder.stdout is not None and holder.stdout.readline() == "has it\n"
            yield holder
        finally:
            holder.kill()


def test_a_holder_that_opens_and_closes_other_files_is_seen_all_the_same(tmp_path: Path) -> None:
    instance = Instance("worm1", tmp_path)
    with held(instance, "controller") as holder:
        found = [instance.holder("controller") for _ in range(2000)]
    assert found.count(holder.pid) == len(found)
    assert instance.holder("controller") is None


def test_a_worm_of_a_robot_that_a_fleet_process_offers_is_told_from_none(tmp_path: Path) -> None:
    instance = Instance("worm1", tmp_path)
    with held(instance, "relay") as fleet:
        with pytest.raises(NotRunning, match="no worm worm1 is running"):
            instance.require_running()
        # As `src/topics/fleet_list.rs` has it: the reason why a worm is not offered, or null.
        worms = {"worm1": None, "worm2": "it runs here"}
        listed = {
            "pid": fleet.pid,
            "config": "fleet.toml",
            "robots": {"robot1": {"was_heard": True, "problem": None, "worms": worms}},
        }
        (tmp_path / "fleet-1-1.json").write_text("{")
        (tmp_path / "fleet-2-2.json").write_text(json.dumps(listed))
        with pytest.raises(NotRunning, match="worm1 is a worm of robot1.*run it on robot1"):
            instance.require_running()
        with pytest.raises(NotRunning, match="no worm worm2 is running"):
            Instance("worm2", tmp_path).require_running()
