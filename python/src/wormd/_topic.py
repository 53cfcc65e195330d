"""What a topic is, for the generated messages."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

M = TypeVar("M", bound="Message")


class Memory(ctypes.Structure):
    """A message where it lies in shared memory."""

    @staticmethod
    def type_name() -> str:
        """Return the name by which iceoryx2 compares types."""
        raise NotImplementedError


class Message:
    """What all messages have in common."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Topic(Generic[M]):
    """A publish-subscribe service of a worm."""

    name: str
    """Last part of the service's name."""
    memory: type[Memory]
    """The message where it lies in shared memory."""
    decode: Callable[[Any], M]
    """Makes the message of its memory."""
    buffer: int
    """Messages that a reader can fall behind before it loses the oldest."""
    history: int
    """Last messages that a late joiner can get."""
    has_event: bool
    """Whether an event wakes its readers."""
    number: str | None
    """The field with the number of the message, which grows by one with each; none where they are not numbered."""


def text(memory: ctypes.Array[ctypes.c_uint8]) -> str:
    """Return a text up to its first zero, or to where it is no UTF-8."""
    until_zero = bytes(memory).split(b"\0", 1)[0]
    try:
        return until_zero.decode()
    except UnicodeDecodeError as error:
        return until_zero[: error.start].decode()
