"""Reads two messages of each topic of the worm of the configuration in the first argument, by the package in `python/`.

Prints the layout of all messages, then "ready", then a line for each message. All lines are JSON.
"""

import ctypes
import dataclasses
import json
import sys

import wormd


def plain(value):
    """A value as the JSON of logs has it: what is not known is null."""
    if isinstance(value, tuple):
        return [plain(one) for one in value]
    return None if value != value else value


MESSAGES = [
    wormd.State,
    wormd.Timing,
    wormd.Estimate,
    wormd.Cycle,
    wormd.Alarm,
    wormd.Range,
    wormd.CommandRecord,
    wormd.RecordingStatus,
    wormd.TripStatus,
    wormd.BlackBoxStatus,
    wormd.Inferred,
]

layouts = {}
for message in MESSAGES:
    memory = message.TOPIC.memory
    fields = {name: getattr(memory, name) for name, _ in memory._fields_}
    layouts[message.TOPIC.name] = {
        "type": memory.type_name(),
        "size": ctypes.sizeof(memory),
        "fields": {name: [field.offset, field.size] for name, field in fields.items()},
    }
print(json.dumps(layouts))

with wormd.Worm(config=sys.argv[1]) as worm:
    streams = [
        worm.states(),
        worm.timing(),
        worm.estimates(),
        worm.cycles(),
        worm.alarms(),
        worm.range(),
        worm.commands(),
        worm.recording(),
        worm.trip(),
        worm.black_box(),
        worm.inferred(),
    ]
    print(json.dumps("ready"), flush=True)
    for stream in streams:
        for _ in range(2):
            message = stream.next(timeout=20)
            fields = {field.name: plain(getattr(message, field.name)) for field in dataclasses.fields(message)}
            print(json.dumps({"topic": message.TOPIC.name, "message": fields}), flush=True)
