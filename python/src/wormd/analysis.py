"""``wormd analyze``: what a worm did and what it cost, by section 3 of the paper."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ._program import ProgressCallback, StrPath, call_json
from ._result import Result
from .errors import WormError


@dataclass(frozen=True)
class CycleFigures(Result):
    """The figures of a gait cycle, or their means or standard deviations."""

    advance_m: float
    """Net displacement, m: mean over the cells."""
    forward_slide_m: tuple[float, ...]
    """Distance that each tip slid forward, m."""
    backward_slide_m: tuple[float, ...]
    """Distance that each tip slid backward, m, counted positive."""
    energy_loss_j: float
    """Energy by losses and weight, equation (11), J."""
    energy_actuator_net_j: float
    """Net actuator work, equation (13), J."""
    energy_actuator_positive_j: float
    """Positive part of the actuator work, J."""


@dataclass(frozen=True)
class AnalyzedCycle(CycleFigures):
    """One whole gait cycle."""

    index: int
    """Number of the cycle in the recording, from 0."""
    start_s: float
    """When it began, s of the recording's time."""
    duration_s: float
    """How long it took, s."""
    settled: bool
    """Whether every tip's contact point was known from its start; only such cycles enter mean and standard deviation."""


@dataclass(frozen=True)
class TheoryCycle(CycleFigures):
    """A steady cycle in theory."""

    max_deformation_m: tuple[float, ...]
    """Largest tip deformations that it is based on, m."""
    rigid_energy_j: float
    """Energy that the same worm on rigid contacts would take over the same advance, J."""


@dataclass(frozen=True)
class Theory(Result):
    """What theory predicts for a steady cycle."""

    identified: TheoryCycle | None
    """The worm with the deformations and stroke found here; None where it slides down."""
    nominal: TheoryCycle | None
    """The configured worm; None where it slides down."""


@dataclass(frozen=True)
class Repair(Result):
    """One repair of a recording, or one observation of what cannot be repaired (docs/experiment.md)."""

    what: str
    """What was seen, as ``swapped-label``."""
    run: int
    """The run, from 1."""
    cell: int | None
    """The cell, from 1; None for all."""
    from_s: float
    """First time concerned, s."""
    to_s: float
    """Last time concerned, s."""
    samples: int
    """Samples that were left out, relabelled, shifted or missing."""
    shift_m: float | None
    """The shift that was estimated, m."""
    shift_sigma_m: float | None
    """Its standard error, m."""
    rate: float | None
    """Speed of a drift: m/s of a camera, s/s of a clock."""


@dataclass(frozen=True)
class FirstEstimate(Result):
    """Largest tip deformations by inspection, section 3.2.1 of the paper."""

    max_deformation_m: tuple[float, ...]
    """m."""


@dataclass(frozen=True)
class PaperSearch(Result):
    """The exhaustive search of section 3.2.3 of the paper."""

    max_deformation_m: tuple[float, ...]
    """The best candidate, m."""
    candidates: int
    """How many were tried."""
    mean_force_n: float
    """Violation of the momentum balance (7) by the best: time mean of the total force, N."""
    force_std_n: float
    """Standard deviation of its total contact force, N."""


@dataclass(frozen=True)
class TorqueProfile(Result):
    """Torque at the cam over the phase of a gait cycle, in bins of equal width, beside the model's."""

    phase: tuple[float, ...]
    """Middle of each bin, as a fraction of the cycle."""
    measured_n_m: tuple[float, ...]
    """Mean torque after the gears' friction and the inertia, N m."""
    model_n_m: tuple[float, ...]
    """The same by the model of the worm that explains it best, N m."""
    residual_n_m: float
    """Root mean square of the difference, N m."""
    cycles: float
    """Cycles that the mean is over; older ones count less."""


@dataclass(frozen=True)
class Analysis(Result):
    """The result for one recording. Tuples over cells begin with cell 1."""

    recording: str
    """The recording, as it was named."""
    slope_deg: float
    """Slope of the canal, degrees."""
    cells: int
    """Number of cells."""
    samples: int
    """Number of samples."""
    duration_s: float
    """Time from the first to the last sample, s."""
    cycle_s: float
    """Mean time of a gait cycle, s."""
    step_order: tuple[int, ...]
    """The cells in the order in which they step, counted from 1."""
    phase_source: str
    """Where the gait phase comes from: ``recorded`` or ``positions``."""
    stroke_m: float
    """Stroke seen in the positions, m."""
    noise_m: float
    """Standard deviation of one measured position, m."""
    first_estimate: FirstEstimate
    """Largest tip deformations by inspection."""
    paper_search: PaperSearch | None
    """The exhaustive search around them; None for more cells than it can try."""
    max_deformation_m: tuple[float, ...]
    """Largest tip deformations by the continuous estimator, m."""
    max_deformation_sigma_m: tuple[float, ...]
    """Their standard errors, m."""
    laid_down: bool
    """Whether the tips were laid down unloaded at the start."""
    mean_deformation_m: float
    """Time mean of the sum of the deformations over whole cycles (8), m."""
    mass_estimate_kg: float | None
    """Mass by (9), kg; None on the level."""
    mass_sigma_kg: float | None
    """Its standard error, kg."""
    momentum_violation_n: float
    """Time mean of the total force (5) with the configured mass, N: 0 where momentum is balanced."""
    damping_ratio: float
    """Damping ratio of the body on its contacts."""
    misfit_ratio: float
    """Variance that theory leaves, over what noise and drift explain: 1 where theory holds."""
    cycles: tuple[AnalyzedCycle, ...]
    """Every whole gait cycle."""
    mean: CycleFigures
    """Mean over the settled cycles."""
    std: CycleFigures
    """Standard deviation over the settled cycles."""
    theory: Theory
    """What theory predicts."""
    rigid_energy_j: float
    """Energy that rigid contacts would take over the measured mean advance, J."""
    warnings: tuple[str, ...]
    """Limitations of these figures."""
    repairs: tuple[Repair, ...]
    """What was repaired in the recording."""
    torque_profile: TorqueProfile | None = None
    """Torque at the cam by the motor's current; None where the recording has no current."""
    report: Path | None = None
    """The page with figures, where a folder was given for it."""


@dataclass(frozen=True)
class CampaignAnalysis(Result):
    """The result for several recordings of one worm."""

    max_deformation_m: tuple[float, ...]
    """Largest tip deformations by all recordings together, m."""
    max_deformation_sigma_m: tuple[float, ...]
    """Their standard errors, m."""
    runs: tuple[Analysis, ...]
    """Each recording."""
    report: Path | None = None
    """The page with figures, where a folder was given for it."""


@dataclass(frozen=True)
class CycleByCurrent(Result):
    """One gait cycle of a worm that nobody saw; advance and losses are those of the worm as it was known then."""

    end_phase: float
    """Gait phase at its end, cycles."""
    end_s: float
    """When it ended, s of the recording's time."""
    is_odd: bool
    """Whether it was set aside, because it is not like those before."""
    advance_m: float
    """Advance, m."""
    advance_sigma_m: float
    """Its standard error, m."""
    energy_loss_j: float
    """Energy by losses and weight (11), J."""
    energy_loss_sigma_j: float
    """Its standard error, J."""
    energy_electrical_j: float
    """Electrical energy of this cycle, measured, J."""


@dataclass(frozen=True)
class AnalysisByCurrent(Result):
    """What the motor's current says of a recording in which nobody saw the worm. Tuples over cells begin with cell 1."""

    recording: str
    """The recording, as it was named."""
    evidence: str
    """``current``: nothing here was seen."""
    slope_deg: float
    """Slope of the canal, degrees."""
    cells: int
    """Number of cells."""
    samples: int
    """Number of readings of the motor."""
    duration_s: float
    """Time from the first to the last, s."""
    cycle_s: float
    """Mean time of a gait cycle, s."""
    step_order: tuple[int, ...]
    """The cells in the order in which they step, counted from 1."""
    max_deformation_m: tuple[float, ...]
    """Largest tip deformations, friction over stiffness, m."""
    max_deformation_sigma_m: tuple[float, ...]
    """Their standard errors, m."""
    friction_n: tuple[float, ...]
    """Friction forces, N."""
    friction_sigma_n: tuple[float, ...]
    """Their standard errors, N."""
    stiffness_n_per_m: tuple[float, ...]
    """Stiffnesses, N/m."""
    stiffness_sigma_n_per_m: tuple[float, ...]
    """Their standard errors, N/m."""
    pull_n: float
    """Pull on the body down the canal, N."""
    pull_sigma_n: float
    """Its standard error, N."""
    cycles: tuple[CycleByCurrent, ...]
    """Every whole gait cycle crawled forward, after the first."""
    mean: CycleFigures
    """A steady cycle of the worm found, by the model."""
    sigma: CycleFigures
    """Its standard errors."""
    energy_electrical_j: float
    """Mean electrical energy of a cycle, measured, J."""
    rigid_energy_j: float
    """Energy that rigid contacts would take over the same advance, J."""
    theory: Theory
    """What theory predicts; ``identified`` is None."""
    warnings: tuple[str, ...]
    """Limitations of these figures."""
    torque_profile: TorqueProfile | None = None
    """Torque at the cam over the phase of a cycle."""
    report: Path | None = None
    """The page with figures, where a folder was given for it."""


def analyze(
    recording: StrPath,
    *,
    slope_deg: float,
    out: StrPath | None = None,
    config: StrPath | None = None,
    payload_kg: float | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    max_gap_s: float | None = None,
    axis: str | None = None,
    progress: ProgressCallback | bool | None = None,
    wormd: StrPath | None = None,
) -> Analysis:
    """Analyse one recording, of any format that ``wormd analyze`` reads: MCAP, CSV, C3D, Vicon CSV.

    Args:
        recording: the file.
        slope_deg: slope of the canal, degrees, positive uphill.
        out: a folder for the page with figures and a CSV of every series.
        config: the worm; without it the one stored in the recording, or the worm of the paper.
        payload_kg: known extra mass.
        from_s: leave out what lies before.
        to_s: leave out what lies after.
        max_gap_s: longest time for which a cell may be out of sight.
        axis: direction up the canal in the space of the markers.
        progress: is told stage and fraction. Without it progress is shown on standard error; False shows nothing.
        wormd: the program.

    Raises:
        ProgramFailed: with the program's message.
        WormError: where nobody saw the worm; `analyze_unseen` takes such a recording.
    """
    given = {"from": from_s, "to": to_s, "max-gap": max_gap_s, "axis": axis}
    arguments = _arguments(recording, slope_deg, out=out, config=config, payload=payload_kg, **given)
    result = call_json(wormd, arguments, progress)
    _refuse_unseen(result)
    return Analysis.of(result, report=page(out))


def analyze_unseen(
    recording: StrPath,
    *,
    slope_deg: float,
    out: StrPath | None = None,
    config: StrPath | None = None,
    payload_kg: float | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: ProgressCallback | bool | None = None,
    wormd: StrPath | None = None,
) -> AnalysisByCurrent:
    """Analyse a recording in which nobody saw the worm, by its motor's current. The arguments are those of `analyze`.

    Raises:
        ProgramFailed: with the program's message.
        WormError: where somebody saw the worm.
    """
    given = {"from": from_s, "to": to_s}
    arguments = _arguments(recording, slope_deg, out=out, config=config, payload=payload_kg, **given)
    result = call_json(wormd, arguments, progress)
    if result.get("evidence") != "current":
        raise WormError(f"{recording}: has positions: use analyze")
    return AnalysisByCurrent.of(result, report=page(out))


def analyze_campaign(
    campaign: StrPath,
    *,
    out: StrPath | None = None,
    progress: ProgressCallback | bool | None = None,
    wormd: StrPath | None = None,
) -> CampaignAnalysis:
    """Analyse several recordings of one worm together, listed in a campaign (docs/experiment.md).

    Raises:
        ProgramFailed: with the program's message.
        WormError: where nobody saw the worm.
    """
    arguments: list[StrPath] = ["analyze", "--json", *options(out=out), "--", campaign]
    result = call_json(wormd, arguments, progress)
    for run in result["runs"]:
        _refuse_unseen(run)
    return CampaignAnalysis.of(result, report=page(out))


def _refuse_unseen(run: dict[str, Any]) -> None:
    if run.get("evidence") == "current":
        raise WormError(f"{run['recording']}: nobody saw the worm: use analyze_unseen, which goes by its motor's current")


def _arguments(recording: StrPath, slope_deg: float, **given: Any) -> list[StrPath]:
    return ["analyze", "--json", f"--slope={slope_deg}", *options(**given), "--", recording]


def options(**given: Any) -> list[str]:
    """Arguments of the options that are not None."""
    return [
        f"--{name}={os.fspath(value) if isinstance(value, os.PathLike) else value}"
        for name, value in given.items()
        if value is not None
    ]


def page(out: StrPath | None) -> Path | None:
    """Return the report in a folder."""
    return None if out is None else Path(out) / "report.html"
