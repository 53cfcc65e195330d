#!/usr/bin/env python3
"""Print alarms as they are raised and cleared.

python3 watch_alarms.py worm1
"""

import sys

import wormd


def main(name: str) -> None:
    with wormd.Worm(name) as worm:
        for alarm in worm.alarms():
            cell = "" if alarm.cell is None else f" of cell {alarm.cell + 1}"
            what = "raised" if alarm.raised else "cleared"
            print(f"{alarm.kind}{cell} {what} ({alarm.severity}): {alarm.value:.3g}, threshold {alarm.threshold:.3g}", flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:2] or ["worm1"])
    except KeyboardInterrupt:
        pass
    except wormd.WormError as error:
        sys.exit(str(error))
