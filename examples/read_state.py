#!/usr/bin/env python3
"""Read a worm's states from Python while wormd runs, by the package in `python/`.

    pip install ./python
    python3 examples/read_state.py --worm worm1 --count 10

Prints one JSON object a line. It never disturbs the worm: a reader that falls behind loses states, the controller does not wait.
"""

import argparse
import json
import sys
from itertools import islice

import wormd


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worm", default="worm1", help="worm.name of the configuration")
    parser.add_argument("--count", type=int, default=10, help="how many states to print")
    arguments = parser.parse_args()
    try:
        with wormd.Worm(arguments.worm) as worm:
            for state in islice(worm.states(), arguments.count):
                positions_mm = [round(1e3 * position, 3) for position in state.position_m]
                print(json.dumps({"sequence": state.sequence, "phase": state.phase, "positions_mm": positions_mm}), flush=True)
    except wormd.WormError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
