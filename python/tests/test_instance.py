"""Who has a role of a worm, by its lock file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from wormd._instance import Instance

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


def test_a_holder_that_opens_and_closes_other_files_is_seen_all_the_same(tmp_path: Path) -> None:
    instance = Instance("worm1", tmp_path)
    instance.folder.mkdir()
    arguments = [sys.executable, "-c", HOLDER, str(instance.folder / "controller.lock")]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as holder:
        try:
            assert holder.stdout is not None and holder.stdout.readline() == "has it\n"
            found = [instance.holder("controller") for _ in range(2000)]
        finally:
            holder.kill()
    assert found.count(holder.pid) == len(found)
    assert instance.holder("controller") is None
