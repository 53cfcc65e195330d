"""``python -m wormd [NAME]``: how a worm is, in a few lines."""

from __future__ import annotations

import argparse
import sys

from .errors import WormError
from .worm import Latest, Worm


def main() -> int:
    """Print it; the exit status is 1 for a worm that does not run."""
    parser = argparse.ArgumentParser(prog="python -m wormd", description="How a running worm is")
    parser.add_argument("name", nargs="?", help="the worm's name; without it the configuration's, or worm1")
    parser.add_argument("--config", help="the worm's configuration")
    arguments = parser.parse_args()
    try:
        with Worm(arguments.name, config=arguments.config) as worm:
            print(_in_words(worm.name, worm.latest()))
    except (WormError, ValueError) as error:
        print(f"wormd: {error}", file=sys.stderr)
        return 1
    return 0


def _in_words(name: str, latest: Latest) -> str:
    state, cycle = latest.state, latest.cycle
    fault = "" if state.fault == "none" else f" ({state.fault})"
    cells = ", ".join(f"{1e3 * position:.1f}" for position in state.position_m)
    lines = [
        f"{name}: {state.mode}{fault}, {state.phase:.2f} gait cycles",
        f"cells    {cells} mm",
        f"motor    {state.motor_current_a:.3f} A, {state.bus_voltage_v:.1f} V, {state.motor_temperature_c:.0f} °C",
    ]
    if cycle is not None:
        energy = f"{1e3 * cycle.energy_loss_j:.1f} mJ of work, {1e3 * cycle.energy_electrical_j:.0f} mJ electrical"
        lines.append(f"cycle {cycle.index:<2} {1e3 * cycle.advance_m:.2f} mm, {energy}")
    if latest.range is not None:
        lines.append(f"range    {latest.range.range_m:.1f} m, {latest.range.time_s / 3600:.1f} h")
    lines.append(f"alarms   {', '.join(latest.raised) or 'none'}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
