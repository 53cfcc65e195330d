"""Where a worm's processes meet: its folder, its prefix in shared memory, and the locks in there."""

from __future__ import annotations

import binascii
import fcntl
import json
import os
import re
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import BadName, NotRunning, WormError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_AUTO = "auto"
# Longest root with twice the worm's name: a socket's path has an end.
_ROOT_LIMIT = 48
_START_LIMIT_S = 3.0


@dataclass(frozen=True)
class Instance:
    """One worm's namespace on this computer."""

    worm: str
    root: Path
    """The folder of all worms, symbolic links resolved."""

    @property
    def folder(self) -> Path:
        """The folder with the worm's locks and the relay's socket; the root path of its iceoryx2."""
        return self.root / self.worm

    @property
    def prefix(self) -> str:
        """What every shared-memory segment of the worm begins with."""
        return f"wormd_{self.worm}_{binascii.crc_hqx(os.fsencode(self.root), 0):04x}_"

    def holder(self, role: str) -> int | None:
        """Return the process that has a role, as ``controller``."""
        return _holder(self.folder / f"{role}.lock")

    def require_running(self) -> int:
        """Return the process of the controller.

        Raises:
            NotRunning: there is none.
        """
        pid = self.holder("controller")
        if pid is None:
            robot = self._offered_from()
            if robot is not None:
                raise NotRunning(
                    f"{self.worm} is a worm of {robot}, which `wormd fleet` offers here, and a script reaches its own computer alone: "
                    f"run it on {robot}; `wormd watch`, `dashboard` and `record` reach {self.worm} from here"
                )
            raise NotRunning(
                f"no worm {self.worm} is running: start it with `wormd up --name {self.worm}`; `wormd status` lists those that run"
            )
        return pid

    def _offered_from(self) -> str | None:
        """Return the robot whose worm a fleet process offers here under this name."""
        holder = self.holder("relay")
        for file in self.root.glob("fleet-*.json") if holder is not None else ():
            try:
                found = json.loads(file.read_text())
                robots = found["robots"].items() if found["pid"] == holder else ()
                # A worm that is not offered has the reason in place of nothing.
                robot = next((robot for robot, it in robots if it["worms"].get(self.worm, "") is None), None)
            except (OSError, ValueError, KeyError, TypeError, AttributeError):
                continue  # Another process may just be writing it, or it is of another version.
            if robot is not None:
                return str(robot)
        return None


def locate(name: str | None, config: str | os.PathLike[str] | None) -> Instance:
    """Find a worm as its own processes do: by the configuration's ``worm.name`` and ``topics.root``."""
    settings = _read_config(Path(config)) if config is not None else {}
    worm = name if name is not None else str(settings.get("worm", {}).get("name", "worm1"))
    if not re.fullmatch(r"[a-z][a-z0-9-]{0,15}", worm):
        raise BadName(f"{worm!r} is no worm's name: 1 to 16 of a-z, 0-9 and '-', beginning with a letter")
    root = str(settings.get("topics", {}).get("root", _AUTO))
    return Instance(worm, _auto_root(worm) if root == _AUTO else Path(root).resolve())


def _read_config(file: Path) -> dict[str, Any]:
    try:
        with file.open("rb") as opened:
            return dict(tomllib.load(opened))
    except OSError as error:
        raise WormError(f"the configuration cannot be read: {error}") from error
    except tomllib.TOMLDecodeError as error:
        raise WormError(f"{file} is no TOML: {error}") from error


def _auto_root(worm: str) -> Path:
    """Return the root in which the worm runs, else the one for a new worm."""
    user = os.geteuid()
    if user == 0:
        return Path("/dev/shm/wormd").resolve()
    runtime, everywhere = Path(f"/run/user/{user}"), Path(f"/dev/shm/wormd-{user}")
    roots = [everywhere]
    is_own = runtime.is_dir() and runtime.stat().st_uid == user
    if is_own and len(str(runtime / "wormd")) + 2 * len(worm) <= _ROOT_LIMIT:
        roots.insert(0, runtime / "wormd")
    running = (root for root in roots if _is_any_held(root / worm))
    return next(running, roots[0]).resolve()


def _is_any_held(folder: Path) -> bool:
    try:
        if folder.lstat().st_uid != os.geteuid():
            return False
        return any(_holder(lock) is not None for lock in folder.glob("*.lock"))
    except OSError:
        return False


def _holder(lock: Path) -> int | None:
    """Return the process that a lock file names, if it uses the file. Creates nothing, and disturbs nobody."""
    try:
        # A role may leave a note below.
        pid = int(lock.read_text().partition("\n")[0])
    except (OSError, ValueError):
        return None
    try:
        return pid if str(lock) in _opened(pid) else None
    except PermissionError:
        # The kernel hides what a process with capabilities has open, but not what it has locked.
        return pid if _has_locked(pid, lock) else None
    except OSError:
        return None


def _opened(pid: int) -> Iterator[str]:
    """Yield what a process has open."""
    for entry in os.scandir(f"/proc/{pid}/fd"):
        # It may close some meanwhile, and those after them count all the same.
        with suppress(FileNotFoundError):
            yield os.readlink(entry.path)


def _has_locked(pid: int, lock: Path) -> bool:
    try:
        status = lock.lstat()
        table = Path("/proc/locks").read_text()
    except OSError:
        return False
    place = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    lines = (line.split() for line in table.splitlines())
    return any(words[1] == "FLOCK" and words[4:6] == [str(pid), place] for words in lines if len(words) > 5)  # noqa: PLR2004


class Presence:
    """Says that this process uses the worm's topics: while it does, no other process wipes them."""

    def __init__(self, instance: Instance) -> None:
        self._instance = instance
        with _starting(instance):
            self._lock = _open(instance.folder / "presence.lock")
            fcntl.flock(self._lock, fcntl.LOCK_SH | fcntl.LOCK_NB)

    def close(self) -> None:
        """End it.

        The last one to leave a worm removes what is left of it. What killed processes left, the next start removes.
        """
        folder = self._instance.folder
        try:
            with _starting(self._instance):
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                for empty in ("nodes", "services"):
                    (folder / empty).rmdir()
                # No node is left, so nobody uses what they shared.
                for segment in Path("/dev/shm").glob(f"{self._instance.prefix}*"):
                    segment.unlink()
                for lock in ("presence", "start"):
                    (folder / f"{lock}.lock").unlink(missing_ok=True)
            folder.rmdir()
        except (OSError, WormError):
            pass  # Others are there, or killed processes left something.
        finally:
            os.close(self._lock)


@contextmanager
def _starting(instance: Instance) -> Iterator[None]:
    """Hold the lock that lets processes start one after another."""
    begun = time.monotonic()
    while True:
        lock = _open(instance.folder / "start.lock")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            if time.monotonic() - begun > _START_LIMIT_S:
                raise WormError(
                    f"the topics of {instance.worm}: another process has been starting for {_START_LIMIT_S:.0f} s: "
                    f"`fuser {instance.folder / 'start.lock'}` says which; end it, and try again"
                ) from None
            time.sleep(0.001)
            continue
        try:
            # The last holder may have removed the file meanwhile.
            if _is_at(instance.folder / "start.lock", lock):
                yield
                return
        finally:
            os.close(lock)


def _open(lock: Path) -> int:
    """Open a lock file in the worm's folder, which must be there and this user's."""
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        opened = os.open(lock, flags, 0o600)
    except FileNotFoundError:
        raise NotRunning(f"{lock.parent} is not there any more: the worm has ended") from None
    except PermissionError:
        raise WormError(f"{lock.parent} belongs to another user: run as the user who started the worm") from None
    if not stat.S_ISREG(os.fstat(opened).st_mode):
        os.close(opened)
        raise WormError(f"{lock} is no regular file: end the worm's processes and remove it")
    return opened


def _is_at(file: Path, opened: int) -> bool:
    try:
        there, ours = file.lstat(), os.fstat(opened)
    except OSError:
        return False
    return (there.st_dev, there.st_ino) == (ours.st_dev, ours.st_ino)
