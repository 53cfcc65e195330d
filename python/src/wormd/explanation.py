"""``wormd explain``: which physical effect the model misses."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ._program import ProgressCallback, StrPath, call_json
from ._result import Result
from .analysis import Repair, options, page


@dataclass(frozen=True)
class Parameter(Result):
    """A parameter of an effect, and the value found."""

    name: str
    """Name in files."""
    value: float
    """Value."""
    sigma: float
    """Its standard error."""
    unit: str
    """Its unit; empty for none."""
    cell: int | None
    """The cell it acts on, from 1; None for all."""


@dataclass(frozen=True)
class Onset(Result):
    """When an effect begins or ends, or does both, that does not act throughout a run."""

    cycle: float
    """Gait cycles since the first sample of the run: where it begins or, with `ends`, where it ends."""
    time_s: float
    """Time since then, s."""
    run: str | None
    """The recording in which it happens once; None where it happens in each."""
    ends: bool
    """It acts up to then, instead of from then on."""
    until_cycle: float | None
    """Where it ends again in the same run, gait cycles since the first sample; None where it stays."""
    until_s: float | None
    """The same in time, s."""


@dataclass(frozen=True)
class Effect(Result):
    """An effect with its values."""

    name: str
    """Its name in the library (docs/explain.md)."""
    twins: tuple[str, ...]
    """What no positions can distinguish from it."""
    parameters: tuple[Parameter, ...]
    """Its parameters."""
    cell: int | None
    """The cell it acts on, from 1; None for all."""
    onset: Onset | None
    """When it begins or ends; None where it acts throughout."""
    together_with: tuple[str, ...]
    """The other effects of the same answer: a pair explains the data only together."""
    closure: float
    """Fraction of the squared gap that it closes on cycles that it was not fitted to; NaN where there is no gap."""
    closure_interval: tuple[float, ...]
    """90 % interval of that."""
    margin: float
    """Its closure less that of the best effect of another kind."""
    probability: float
    """Posterior probability of its class."""
    improvement: float
    """Rise of twice the log likelihood over the recalibrated model."""
    separated_by: str
    """Which experiment distinguishes it from its neighbours."""


@dataclass(frozen=True)
class Place(Result):
    """A place where model and data disagree."""

    cell: int
    """The cell that is not where the model has it, from 1."""
    stepping_cell: int
    """The cell that steps meanwhile, from 1."""
    phase: float
    """Gait phase, 0 to 1."""
    slope_deg: float
    """Slope of the run, degrees."""
    residual_m: float
    """Displacement of the cell beyond the model's, m in each cycle."""
    significance: float
    """That in standard errors."""


@dataclass(frozen=True)
class TorqueGap(Result):
    """How far a stage's torque on the cam is off."""

    fit_rms_n_m: float
    """Root mean square of the residual on the data it was fitted to, N m."""
    held_out_rms_n_m: float
    """The same on cycles that it was not fitted to, N m."""
    held_out_interval_n_m: tuple[float, ...]
    """90 % interval of that, N m."""


@dataclass(frozen=True)
class Stage(Result):
    """A model in the order in which the gap between model and data shrinks."""

    stage: str
    """Which: ``baseline``, ``recalibrated``, ``best-wrong``, ``named``, ``law``, ``free-form`` or ``floor``."""
    effect: str | None
    """The effect, where the stage has one."""
    fit_rms_m: float
    """Root mean square of the residual on the data it was fitted to, m."""
    held_out_rms_m: float
    """The same on cycles that it was not fitted to, m."""
    held_out_interval_m: tuple[float, ...]
    """90 % interval of that, m."""
    advance_error_m: float
    """How far the advance per cycle is off, m."""
    advance_error_interval_m: tuple[float, ...]
    """90 % interval of that, m."""
    energy_error_j: float
    """How far the energy per cycle is off, J."""
    torque: TorqueGap | None
    """Of the torque, where the motor's current counts; without positions it is all that the gap is judged by."""


@dataclass(frozen=True)
class Remainder(Result):
    """What no effect explains."""

    description: str
    """In words."""
    open_share: float
    """Fraction of the gap that stays open after the best effect."""
    onset: Onset | None
    """Where something begins in mid-run."""
    period_cycles: float | None
    """Period in cycles, where it repeats in time."""
    period_m: float | None
    """Period along the canal, m, where it repeats in space."""
    places: tuple[Place, ...]
    """Where it is largest."""


@dataclass(frozen=True)
class Prediction(Result):
    """What an effect predicts for an experiment."""

    effect: str
    """The effect."""
    advance_m: float | None
    """Advance per cycle that it predicts, m."""
    description: str
    """In words."""


@dataclass(frozen=True)
class NextExperiment(Result):
    """The experiment that would best decide between what is left open."""

    change: str
    """What to change, as ``slope_deg``, or to measure."""
    value: float | None
    """The new value; None for a measurement."""
    unit: str
    """Its unit."""
    slope_deg: float | None
    """Slope of the run to make, degrees."""
    description: str
    """In words, with how to do it."""
    predictions: tuple[Prediction, ...]
    """What each rival predicts."""
    separation_sigma: float | None
    """Distance between the two nearest predictions, in standard deviations."""


@dataclass(frozen=True)
class Calibrated(Result):
    """A parameter of the recalibrated model."""

    name: str
    """What it is."""
    believed: float
    """The nominal value."""
    found: float
    """The value found."""
    sigma: float
    """Its standard error."""
    unit: str
    """Its unit; empty for none."""
    at_limit: bool
    """It lies on a limit of its prior."""


@dataclass(frozen=True)
class Screened(Result):
    """What became of an effect in the screening."""

    name: str
    """The effect."""
    cell: int | None
    """The cell it acts on, from 1; None for all."""
    score: float
    """Expected rise of twice the log likelihood, to first order."""
    improvement: float | None
    """Rise by the refit; None where it was not refitted."""
    outcome: str
    """``screened-out``, ``refitted``, ``did-not-converge``, ``not-visible`` or ``left-out``."""


@dataclass(frozen=True)
class CurrentEvidence(Result):
    """What the motor's current shows of a run, beside what models have it show."""

    torque_residual_n_m: tuple[float, ...]
    """Torque on the cam that stays unexplained: by the recalibrated model, by the named one, N m."""
    work_j: tuple[float, ...]
    """Net work that the cam takes in a cycle: by the current, by the recalibrated model, by the named one, J."""


@dataclass(frozen=True)
class ExplainedRun(Result):
    """A recording that was explained."""

    recording: str
    """Where it comes from."""
    slope_deg: float
    """Slope, degrees."""
    payload_kg: float
    """Known extra mass, kg."""
    cycles: int
    """Whole gait cycles."""
    cycle_s: float
    """Time of a gait cycle, s."""
    phase_recorded: bool
    """Whether the gait phase was recorded."""
    sees_positions: bool
    """Whether positions count; where they do not, the motor's current alone is evidence."""
    laid_down: bool
    """Whether the recording starts with the worm just laid down."""
    noise_m: float
    """Standard deviation of one position, m."""
    drift_per_cycle_m: float
    """Random walk of the body in a cycle beyond any model, m."""
    advance_m: tuple[float, ...]
    """Mean advance per cycle: measured, by the recalibrated model, by the named one, m."""
    advance_sigma_m: float | None
    """Standard error of the measured advance, m, where the run is known by its advance alone."""
    current: CurrentEvidence | None
    """What the motor's current shows, where it counts as evidence."""


@dataclass(frozen=True)
class LawOver(Result):
    """What a law is about."""

    acts_on: str
    """``contact-force``, N, ``friction-factor``, or ``drive-displacement``, m."""
    axis: str | list[str]
    """What it depends on; two as a list."""
    cell: int | None
    """The cell that it is about, from 1; None for all."""
    period: float | None
    """Width after which it repeats, in the unit of its first axis."""


@dataclass(frozen=True)
class Law(LawOver):
    """A law that no effect of the library is, at the points of a grid."""

    sentence: str
    """The law in a sentence."""
    grid: list[float] | list[list[float]]
    """The points; of two axes those of each."""
    value: tuple[float, ...]
    """The value at each point; of two axes those of the second for each point of the first, one after the other."""
    band: tuple[tuple[float, ...], ...]
    """90 % band of each."""
    formula: str | None
    """The nearest formula of few terms, in SI units, where one predicts as well."""
    closure: float
    """Fraction of the squared gap that it closes on data that it was not fitted to."""
    closure_interval: tuple[float, ...]
    """90 % interval of that."""
    improvement: float
    """Rise of twice the log likelihood of these cycles."""
    rivals: tuple[LawOver, ...]
    """Other laws that predict about as well."""


@dataclass(frozen=True)
class Explanation(Result):
    """The answer. Cells count from 1; `docs/explain.md` says how it is found and how far to trust it."""

    verdict: str
    """``agrees``, ``explained``, ``ambiguous`` or ``outside-library``."""
    sentence: str
    """The verdict in a sentence or two."""
    effects: tuple[Effect, ...]
    """The effects that explain the data: one, or a pair; empty unless explained or ambiguous."""
    rivals: tuple[Effect, ...]
    """Others that explain them about as well, best first."""
    where: tuple[Place, ...]
    """Where model and data disagree after recalibration, most significant first."""
    gap: tuple[Stage, ...]
    """The gap, stage by stage."""
    remainder: Remainder | None
    """What is left, where nothing explains it."""
    law: Law | None
    """The law that describes it, where one does."""
    next_experiment: NextExperiment | None
    """The experiment that would best decide what is left open."""
    calibration: tuple[Calibrated, ...]
    """The recalibrated model."""
    screening: tuple[Screened, ...]
    """The screening of the whole library."""
    threshold: float
    """Improvement that the best of the library stays below in 99 of 100 worms without an effect."""
    null_probability: float
    """Probability that nothing is missing that matters, counting what recalibration can hide."""
    other_probability: float
    """Probability that something else is missing, counting effects that are unlike their laws."""
    misstated_probability: float | None
    """Probability that nothing is missing and conditions are not as stated, where a usual mistake explains anything."""
    agrees_within_m: float
    """Measured and modelled advance differ by no more than this, m, with a probability of 95 %."""
    agrees_within_j: float | None
    """The work of a cycle by the motor's current and by the model differ by no more than this, J; where the current counts."""
    discrepancy_m: float
    """What the model is taken to be wrong by everywhere, m."""
    friction_scatter: float | None
    """What each tip's friction would have to differ by from cycle to cycle to move the body as irregularly, where that was seen."""
    runs: tuple[ExplainedRun, ...]
    """The recordings."""
    warnings: tuple[str, ...]
    """Limitations of this answer."""
    repairs: tuple[Repair, ...]
    """What was repaired in the recordings."""
    report: Path | None = None
    """The page with figures, where a folder was given for it."""
    model: Path | None = None
    """Your configuration, recalibrated, with the effect in it; likewise."""


@dataclass(frozen=True)
class Run:
    """A recording of a campaign."""

    recording: StrPath
    """The file."""
    slope_deg: float
    """Slope of the canal, degrees, positive uphill."""
    payload_kg: float | None = None
    """Known extra mass, kg."""
    cycle_s: float | None = None
    """Time of a gait cycle where it is not the configured one, s."""


def explain(
    campaign: StrPath | Sequence[Run],
    *,
    slope_deg: float | None = None,
    out: StrPath | None = None,
    config: StrPath | None = None,
    seed: int | None = None,
    discrepancy: float | None = None,
    matters: float | None = None,
    expected_impact: float | None = None,
    scatter: float | None = None,
    current: bool | Literal["alone"] = False,
    progress: ProgressCallback | bool | None = None,
    wormd: StrPath | None = None,
) -> Explanation:
    """Find the effect that the model misses.

    Args:
        campaign: a campaign (TOML), one recording, or runs.
        slope_deg: slope of the one recording, degrees.
        out: a folder for the report and the model; the campaign of runs goes there, too.
        config: the worm; without it the one stored in the recording, or the worm of the paper. A campaign file names its own.
        seed: of the search.
        discrepancy: what the model is taken to be wrong by everywhere, as a fraction of the largest deformation.
        matters: relative change of advance or energy that matters.
        expected_impact: how much of the advance an effect is expected to cost or bring.
        scatter: how much the friction of a tip usually differs from one cycle to the next, as a fraction.
        current: takes the motor's current as evidence, too, or alone: then positions are not looked at.
        progress: is told stage and fraction. Without it progress is shown on standard error; False shows nothing.
        wormd: the program.

    Raises:
        ProgramFailed: with the program's message.
    """
    more = options(
        slope=slope_deg,
        out=out,
        seed=seed,
        discrepancy=discrepancy,
        matters=matters,
        **{"expected-impact": expected_impact},
        scatter=scatter,
    )
    if current:
        more.append("--current=alone" if current == "alone" else "--current")
    with tempfile.TemporaryDirectory(prefix="wormd-") as folder:
        if isinstance(campaign, (str, os.PathLike)):
            source: StrPath = campaign
            more += options(config=config)
        else:
            source = write_campaign(campaign, Path(folder if out is None else out) / "campaign.toml", config=config)
        answer: dict[str, Any] = call_json(wormd, ["explain", "--json", *more, "--", source], progress)
    model = None if out is None else Path(out) / "model.toml"
    return Explanation.of(answer, report=page(out), model=model)


def write_campaign(runs: Iterable[Run], file: StrPath, *, config: StrPath | None = None) -> Path:
    """Write a campaign file, and return its path.

    Args:
        runs: recordings of one worm, in the order in which they were made.
        file: where to.
        config: the worm.
    """
    lines = [] if config is None else [f"worm = {_quoted(config)}"]
    for run in runs:
        lines += ["[[run]]", f"recording = {_quoted(run.recording)}", f"slope_deg = {float(run.slope_deg)!r}"]
        more = {"payload_kg": run.payload_kg, "cycle_s": run.cycle_s}
        lines += [f"{name} = {float(value)!r}" for name, value in more.items() if value is not None]
    path = Path(file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _quoted(path: StrPath) -> str:
    """Return the absolute path as TOML."""
    return json.dumps(os.path.abspath(path), ensure_ascii=False)
