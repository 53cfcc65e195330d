"""What can go wrong, one class for each thing that a script may want to tell apart."""

from __future__ import annotations


class WormError(Exception):
    """Anything that this package reports. The text says what was wrong and what to do."""


class NotRunning(WormError):
    """There is no such worm, or it has ended."""


class BadName(WormError, ValueError):
    """No worm can have this name."""


class OtherVersion(WormError):
    """The worm runs a version of wormd with other messages than this package knows."""


class Silent(WormError, TimeoutError):
    """Nothing came within the time that was given."""


class RelayLost(WormError):
    """The relay of the worm cannot be reached. A crawl that was given by it ends in a hold within a second."""


class Refused(WormError):
    """A command was not carried out."""

    command: str
    """The command, as ``crawl``."""
    verdict: str
    """Why, as a word: ``wrong-mode``, ``alarm-stands``, ``not-driver`` and the like (docs/operating.md)."""
    reason: str
    """Why, in words, and what to do."""
    mode: str | None
    """The controller's mode, where it answered."""
    fault: str | None
    """The controller's fault, where it answered."""

    def __init__(self, command: str, verdict: str, reason: str, mode: str | None = None, fault: str | None = None):
        super().__init__(f"{command}: {reason} ({verdict})")
        self.command, self.verdict, self.reason, self.mode, self.fault = command, verdict, reason, mode, fault


class NotDriver(Refused):
    """Somebody else drives the worm; the reason has the name. ``Worm.take_over`` takes the worm from them."""


class ProgramFailed(WormError):
    """A call of the program ``wormd`` ended with an error, whose text this is."""

    status: int
    """Its exit status: 2 for arguments, files or a worm that cannot be used, 1 for what failed while it ran."""

    def __init__(self, message: str, status: int):
        super().__init__(message)
        self.status = status


class ProgramNotFound(WormError):
    """The program ``wormd`` is not on this computer, or not where it was looked for."""
