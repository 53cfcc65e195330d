#!/usr/bin/env python3
"""Show live what each gait cycle costs, and where the energy goes.

python3 energy_per_cycle.py worm1
"""

import sys

import wormd

ROW = "{:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}"


def main(name: str) -> None:
    print(ROW.format("cycle", "advance", "battery", "copper", "gears", "work", "per metre"))
    print(ROW.format("", "mm", "mJ", "mJ", "mJ", "mJ", "J"))
    with wormd.Worm(name) as worm:
        for cycle in worm.cycles(history=True):
            figures = (
                1e3 * cycle.advance_m,
                1e3 * cycle.energy_electrical_j,
                1e3 * cycle.energy_copper_j,
                1e3 * cycle.energy_friction_inside_j,
                1e3 * cycle.energy_actuator_net_j,
                cycle.energy_electrical_j / cycle.advance_m,
            )
            print(ROW.format(cycle.index, *(f"{figure:.2f}" for figure in figures)), flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:2] or ["worm1"])
    except KeyboardInterrupt:
        pass
    except wormd.WormError as error:
        sys.exit(str(error))
