#!/usr/bin/env python3
"""Crawl at several speeds, record it, and print what distance and energy depend on.

    python3 speed_sweep.py worm1 sweep.mcap

The worm crawls only while this script lives: Ctrl-C, a crash or kill -9 make it hold.
"""

import sys
from itertools import islice

import wormd

SPEEDS_CYCLES_PER_S = (0.2, 0.4, 0.6)
CYCLES = 3  # at each speed, after the first, in which the speed changes


def main(name: str, log: str) -> None:
    with wormd.Worm(name) as worm, worm.record(log):
        if worm.latest().state.mode == "disarmed":
            worm.arm()
        for speed in SPEEDS_CYCLES_PER_S:
            worm.crawl(speed)
            with worm.cycles(timeout=3 / speed) as cycles:
                next(cycles)
                done = list(islice(cycles, CYCLES))
            advance_m = sum(cycle.advance_m for cycle in done) / CYCLES
            energy_j = sum(cycle.energy_electrical_j for cycle in done) / CYCLES
            print(f"{speed} cycles/s: {1e3 * advance_m:.2f} mm and {1e3 * energy_j:.0f} mJ a cycle", flush=True)
        worm.hold()
    print(f"recorded in {log}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit((__doc__ or "").strip())
    try:
        main(*sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit("interrupted; the worm holds")
    except wormd.WormError as error:
        sys.exit(str(error))
