#!/usr/bin/env python3
"""Read a log of `wormd up --record F.mcap` or `wormd record` with the official mcap package.

    pip install mcap
    python3 read_log.py run.mcap                        # the topics, and how many messages each holds
    python3 read_log.py run.mcap /cycle advance_m       # one field of one topic over time, as CSV

Messages are JSON with a schema that tells meaning and unit of every field, so nothing else is needed. A log that was cut off
by a crash is read to its last whole message, in the order of writing.
"""

import json
import sys

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader


def messages(file):
    """Topic, time in s and content of every message, to the end or to where the log was cut off."""
    try:
        for _, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            yield channel.topic, message.log_time * 1e-9, json.loads(message.data)
    except (McapError, EOFError) as error:
        print(f"cut off here: {error}", file=sys.stderr)


def main():
    if len(sys.argv) not in (2, 4):
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        if len(sys.argv) == 2:
            counts = {}
            for topic, _, _ in messages(file):
                counts[topic] = counts.get(topic, 0) + 1
            for topic, count in sorted(counts.items()):
                print(f"{topic}: {count} messages")
        else:
            _, wanted, field = sys.argv[1:]
            print(f"time_s,{field}")
            for topic, time_s, content in messages(file):
                if topic == wanted:
                    print(f"{time_s:.6f},{content[field]}")


if __name__ == "__main__":
    main()
