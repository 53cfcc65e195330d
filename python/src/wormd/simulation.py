"""``wormd simulate``: what motion capture would have seen of a worm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from ._program import StrPath, call
from .analysis import options


def simulate(
    out: StrPath,
    *,
    slope_deg: float,
    cycles: float,
    effects: Iterable[str] = (),
    config: StrPath | None = None,
    rate_hz: float | None = None,
    noise_m: float | None = None,
    seed: int | None = None,
    dropout_share: float | None = None,
    max_deformation_m: Sequence[float] | None = None,
    cycle_s: float | None = None,
    positions_only: bool = False,
    rest_s: float | None = None,
    wormd: StrPath | None = None,
) -> Path:
    """Write a recording of the model's worm, and return its path.

    Args:
        out: the file, ``*.csv`` or ``*.mcap``; an older one is replaced.
        slope_deg: slope of the canal, degrees, positive uphill.
        cycles: number of gait cycles.
        effects: effects beyond the paper's theory, as ``unequal-clamping:cell=2,friction_factor=0.7`` (docs/explain.md).
        config: the worm; without it that of the paper.
        rate_hz: samples per second.
        noise_m: standard deviation of one measured position.
        seed: of noise and dropouts.
        dropout_share: share of the positions that are not seen.
        max_deformation_m: largest tip deformation of each cell, cell 1 first.
        cycle_s: time of a gait cycle.
        positions_only: leave the gait phase out, as motion capture does.
        rest_s: time at rest before and after.
        wormd: the program.

    Raises:
        ProgramFailed: with the program's message.
    """
    in_mm = None if max_deformation_m is None else ",".join(repr(1e3 * value) for value in max_deformation_m)
    arguments: list[StrPath] = ["simulate", f"--slope={slope_deg}", f"--cycles={cycles}"]
    arguments += options(
        out=out,
        config=config,
        rate=rate_hz,
        noise=noise_m,
        seed=seed,
        dropout=dropout_share,
        rest=rest_s,
        **{"cycle-s": cycle_s, "max-deformation-mm": in_mm},
    )
    arguments += [f"--effect={effect}" for effect in effects]
    if positions_only:
        arguments.append("--positions-only")
    call(wormd, arguments, progress=False)
    return Path(out)
