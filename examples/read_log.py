#!/usr/bin/env python3
"""Read a log of `wormd up --record F.mcap` or `wormd record` with the official mcap packages.

    pip install mcap mcap-protobuf-support
    python3 read_log.py run.mcap                        # the topics, and how many messages each holds
    python3 read_log.py run.mcap /cycle advance_m       # one field of one topic over time, as CSV

Messages are in Protocol Buffers, with their descriptor in the log; in logs of older versions they are JSON. A log that was truncated
by a crash is read to its last whole message, in the order of writing.
"""

import json
import sys

from mcap.decoder import DecoderFactory
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoderFactory


class JsonDecoderFactory(DecoderFactory):
    """Decodes the messages of older logs."""

    def decoder_for(self, message_encoding, schema):
        return json.loads if message_encoding == "json" else None


def fields(content):
    """The fields of a message by name. What is not known is None, and enumerations are names, as `MODE_CRAWLING`."""
    if isinstance(content, dict):
        return content
    found = {}
    for field in content.DESCRIPTOR.fields:
        value = getattr(content, field.name)
        if field.has_presence and not content.HasField(field.name):
            value = None
        elif field.enum_type is not None:
            named = field.enum_type.values_by_number.get(value)
            value = named.name if named else value
        elif not isinstance(value, (int, float)):
            value = [None if number != number else number for number in value]
        elif value != value:
            value = None
        found[field.name] = value
    return found


def messages(file):
    """Topic, time in s and fields of every message, to the end or to where the log was cut off."""
    reader = NonSeekingReader(file, decoder_factories=[ProtobufDecoderFactory(), JsonDecoderFactory()])
    try:
        for _, channel, message, content in reader.iter_decoded_messages(log_time_order=False):
            yield channel.topic, message.log_time * 1e-9, fields(content)
    except (McapError, EOFError) as error:
        print(f"the log is cut off here: {str(error) or type(error).__name__}", file=sys.stderr)


def print_counts(file):
    counts = {}
    for topic, _, _ in messages(file):
        counts[topic] = counts.get(topic, 0) + 1
    for topic, count in sorted(counts.items()):
        print(f"{topic}: {count} messages")


def print_field(file, topic, field):
    is_first = True
    for name, time_s, content in messages(file):
        if name != topic:
            continue
        if field not in content:
            sys.exit(f"{topic} has no field {field}; it has {', '.join(content)}")
        if is_first:
            print(f"time_s,{field}")
            is_first = False
        print(f"{time_s:.6f},{content[field]}")
    if is_first:
        sys.exit(f"there is no message on {topic}: call this program with the log alone to list its topics")


def main():
    if len(sys.argv) not in (2, 4):
        sys.exit(__doc__)
    try:
        with open(sys.argv[1], "rb") as file:
            if len(sys.argv) == 2:
                print_counts(file)
            else:
                print_field(file, *sys.argv[2:])
    except OSError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
