"""Enumerations that cross topics as numbers, and are names everywhere else."""

from __future__ import annotations

from enum import Enum
from typing import TypeVar

C = TypeVar("C", bound="Code")

_MEMBERS: dict[type[Code], dict[int, Code]] = {}


class Code(str, Enum):
    """A value that is its own name, as in logs: ``Mode.CRAWLING == "crawling"``."""

    code: int
    """The number that crosses the topic."""

    def __new__(cls, name: str, code: int) -> Code:
        """Make the member ``name`` with its number."""
        member = str.__new__(cls, name)
        member._value_ = name
        member.code = code
        return member

    def __str__(self) -> str:
        return str(self.value)

    def __format__(self, spec: str) -> str:
        return format(str(self.value), spec)

    @classmethod
    def of(cls: type[C], code: int) -> C:
        """Return the value with this number. One that only a newer version knows is called ``unknown-<number>``."""
        members = _MEMBERS.get(cls)
        if members is None:
            members = _MEMBERS[cls] = {member.code: member for member in cls}
        member = members.get(code)
        if member is None:
            member = str.__new__(cls, f"unknown-{code}")
            member._name_ = f"UNKNOWN_{code}"
            member._value_ = f"unknown-{code}"
            member.code = code
            members[code] = member
        assert isinstance(member, cls)
        return member
