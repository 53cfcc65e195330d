"""Objects from the JSON that the program prints."""

from __future__ import annotations

import dataclasses
import types
import typing
from dataclasses import dataclass
from typing import Any, TypeVar

R = TypeVar("R", bound="Result")


@dataclass(frozen=True)
class Result:
    """An object of a result. What a newer program says beyond the attributes here is in `json`."""

    json: dict[str, Any] = dataclasses.field(repr=False, compare=False)
    """The JSON object as it was printed."""

    @classmethod
    def of(cls: type[R], json: dict[str, Any], **more: Any) -> R:
        """Make the object of a JSON object; what an older program does not say is None, NaN or empty."""
        hints = _hints(cls)
        named = {name: _value(hint, json.get(name)) for name, hint in hints.items() if name not in more}
        return cls(**{"json": json, **named, **more})


_HINTS: dict[type[Result], dict[str, Any]] = {}


def _hints(cls: type[Result]) -> dict[str, Any]:
    if cls not in _HINTS:
        hints = typing.get_type_hints(cls)
        _HINTS[cls] = {field.name: hints[field.name] for field in dataclasses.fields(cls) if field.name != "json"}
    return _HINTS[cls]


def _value(hint: Any, json: Any) -> Any:
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType:
        known = next(one for one in inner if one is not types.NoneType)
        return None if json is None else _value(known, json)
    if origin is tuple:
        return tuple(_value(inner[0], one) for one in json or ())
    if hint is float:
        return float("nan") if json is None else float(json)
    if isinstance(hint, type) and issubclass(hint, Result):
        return hint.of(json or {})
    return json
