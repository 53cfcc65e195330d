#!/usr/bin/env python3
"""Write src/wormd/_messages.py and ../include/wormd.h from what the binary says of its messages.

    cargo build --release --bin wormd
    python3 python/generate.py target/release/wormd           # writes both files
    python3 python/generate.py target/release/wormd --check   # exit status 1 where they differ

Needs nothing but Python. Run it whenever a message, an enumeration or a topic changes.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
MESSAGES = HERE / "src" / "wormd" / "_messages.py"
HEADER = HERE.parent / "include" / "wormd.h"

Json = dict[str, Any]

PYTHON_TYPES = {"f64": "float", "u64": "int", "u32": "int", "i32": "int"}
C_TYPES = {"f64": "c_double", "u64": "c_uint64", "u32": "c_uint32", "i32": "c_int32", "u8": "c_uint8"}

HEAD = '''\
"""The messages on the topics of a worm, and their enumerations.

Made by generate.py from `wormd topics --json`, version {version}; do not edit.

Numbers that are not known are NaN; what may be missing is None. Tuples over cells are as long as there are cells, and
cell 1 of the paper is index 0. Times are nanoseconds of CLOCK_MONOTONIC.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import ClassVar

from ._codes import Code
from ._topic import Memory, Message, Topic, text

VERSION = "{version}"
"""Version of wormd that these messages are of."""

MAX_CELLS = {max_cells}
_NONE = 0xFFFFFFFF
'''


def docstring(documentation: str, indent: str) -> str:
    """A docstring of lines that are not too long."""
    return textwrap.fill(
        '"""' + documentation.replace("u32::MAX", "None").replace("::", ".") + '"""',
        width=118,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def member(name: str) -> str:
    """``LEASE_LAPSED`` of ``lease-lapsed``."""
    return re.sub(r"\W", "_", name).upper()


def enumeration(described: Json) -> str:
    lines = [f"class {described['name']}(Code):", docstring(described["documentation"], "    "), ""]
    for value in described["values"]:
        lines.append(f'    {member(value["name"])} = "{value["name"]}", {value["code"]}')
        lines.append(docstring(value["documentation"], "    "))
    return "\n".join(lines)


def annotation(field: Json) -> str:
    """The type of a field in the dataclass."""
    of_one = {"per-cell": "tuple[float, ...]", "text": "str", "code": field["enumeration"]}
    name = of_one.get(field["holds"], PYTHON_TYPES.get(field["type"]))
    return f"{name} | None" if field["optional"] else str(name)


def decoded(field: Json) -> str:
    """The expression that makes the field's value from the memory `m`."""
    value = f"m.{field['name']}"
    known = {
        "per-cell": f"tuple({value}[:cells])",
        "text": f"text({value})",
        "code": f"{field['enumeration']}.of({value})",
    }.get(field["holds"], value)
    return f"None if {value} == _NONE else {known}" if field["optional"] else known


def structure(described: Json) -> str:
    """The memory of a message, as iceoryx2 delivers it."""
    lines = [f"class _{described['name']}Memory(Memory):", "    _fields_ = ["]
    for field in described["fields"]:
        c_type = f"ctypes.{C_TYPES[field['type']]}"
        if field["count"] is not None:
            c_type += f" * {field['count']}"
        lines.append(f'        ("{field["name"]}", {c_type}),')
    lines += [
        "    ]",
        "",
        "    @staticmethod",
        "    def type_name() -> str:",
        f'        return "{described["type"]}"',
    ]
    return "\n".join(lines)


def message(topic: Json) -> str:
    """The dataclass of a topic."""
    described, name = topic["message"], topic["message"]["name"]
    lines = [
        "@dataclass(frozen=True, slots=True)",
        f"class {name}(Message):",
        docstring(described["documentation"], "    "),
        "",
        f"    TOPIC: ClassVar[Topic[{name}]]",
        "",
    ]
    for field in described["fields"]:
        lines.append(f"    {field['name']}: {annotation(field)}")
        lines.append(docstring(field["documentation"], "    "))
    lines += ["", "    @classmethod", f"    def _from_memory(cls, m: _{name}Memory) -> {name}:"]
    if any(field["holds"] == "per-cell" for field in described["fields"]):
        # A list is as long as there are cells; that of a trip as there are points.
        names = [field["name"] for field in described["fields"]]
        count = "cell_count" if "cell_count" in names else "point_count"
        lines.append(f"        cells = min(m.{count}, MAX_CELLS)")
    lines.append("        return cls(")
    lines += [f"            {field['name']}={decoded(field)}," for field in described["fields"]]
    lines += ["        )"]
    number = f'"{topic["number_field"]}"' if topic["number_field"] else "None"
    lines += [
        "",
        "",
        f"{name}.TOPIC = Topic(",
        f'    name="{topic["name"]}",',
        f"    memory=_{name}Memory,",
        f"    decode={name}._from_memory,",
        f"    buffer={topic['buffer']},",
        f"    history={topic['history']},",
        f"    has_event={topic['event']},",
        f"    number={number},",
        ")",
    ]
    return "\n".join(lines)


def python_module(described: Json) -> str:
    """The whole of _messages.py."""
    parts = [HEAD.format(**described).rstrip("\n")]
    parts += [enumeration(one) for one in described["enumerations"] if is_used(one, described)]
    for topic in described["topics"]:
        parts += [structure(topic["message"]), message(topic)]
    return "\n\n\n".join(parts) + "\n"


def is_used(enumeration: Json, described: Json) -> bool:
    fields = (field for topic in described["topics"] for field in topic["message"]["fields"])
    return any(field["enumeration"] == enumeration["name"] for field in fields)


def output_of(wormd: str, *arguments: str) -> str:
    return subprocess.run([wormd, *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("wormd", help="the binary")
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    arguments = parser.parse_args()
    described = json.loads(output_of(arguments.wormd, "topics", "--json"))
    files = {MESSAGES: python_module(described), HEADER: output_of(arguments.wormd, "topics", "--c-header")}
    stale = [file for file, text in files.items() if not file.exists() or file.read_text() != text]
    for file in stale:
        if arguments.check:
            print(f"{file} is not what {arguments.wormd} says: run python/generate.py", file=sys.stderr)
        else:
            file.parent.mkdir(exist_ok=True)
            file.write_text(files[file])
            print(file)
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
