"""Campaigns of MuJoCo worms: drawn, crawled, and written as recordings with their truth."""

import copy
import json
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

import effects
from detectability import Detector
from worm import GRAVITY, CrawlFailed, Run, Scene, Worm, simulate

# The nominal worm that every campaign believes in; as in the library's default configuration, but for the number of cells.
NOMINAL_TOML = """# The worm as it is believed to be.
[worm]
cells = {cells}
mass_kg = {mass}
step_order = {order}

[gait]
cycle_s = {cycle_s}

# Fast enough for a cycle of 0.8 s.
[servo]
velocity_limit_rev_per_min = 100.0
"""


@dataclass
class Capture:
    """The camera and its noise."""

    rate_hz: float
    # Standard deviation of the white part, m.
    noise_m: float
    # Of the part that is correlated over `drift_s`, m.
    drift_m: float
    drift_s: float
    dropout: float
    with_phase: bool

    def measure(self, position_m: np.ndarray, rng) -> np.ndarray:
        """Noisy positions; `nan` where a cell was not seen."""
        keep = np.exp(-1.0 / (self.rate_hz * self.drift_s))
        drift = np.empty_like(position_m)
        state = rng.standard_normal(position_m.shape[1]) * self.drift_m
        for row in range(len(position_m)):
            drift[row] = state
            state = keep * state + np.sqrt(1.0 - keep**2) * self.drift_m * rng.standard_normal(len(state))
        seen = position_m + drift + self.noise_m * rng.standard_normal(position_m.shape)
        seen[rng.random(seen.shape) < self.dropout] = np.nan
        return seen


@dataclass
class Plan:
    """One campaign before it is simulated."""

    name: str
    # "clean", "single", "pair", "stranger" or "onset".
    kind: str
    seed: int
    worm: Worm
    hidden: list
    # For each run: the stated slope, the true one, the scene, and the cycle at which what is hidden begins.
    runs: list
    capture: Capture
    cycle_s: float


def draw_worm(cells: int, rng) -> Worm:
    """A worm within the priors."""
    worm = Worm.nominal(cells)
    about = lambda sigma, count=cells: 1.0 + sigma * np.clip(rng.standard_normal(count), -2.5, 2.5)
    worm.mass_kg *= float(about(0.005, 1)[0])
    worm.friction_n = worm.friction_n * about(0.06, 1) * about(0.02)
    worm.stiffness_n_per_m = worm.stiffness_n_per_m * about(0.04, 1) * about(0.015)
    worm.stroke_m = worm.stroke_m * about(0.008, 1) * about(0.001)
    worm.damping_n_s_per_m = np.full(cells, 6.0 * 3.0 ** rng.random())
    worm.rounding = float(0.01 * 5.0 ** rng.random())
    worm.tip_kg = float(0.003 * 2.0 ** rng.random())
    worm.softness = float(0.05 * 6.0 ** rng.random())
    worm.spacing_m = float(rng.uniform(0.036, 0.044))
    worm.scatter = float(rng.uniform(0.003, 0.012))
    if rng.random() < 0.2:
        worm.step_order = rng.permutation(cells)
    return worm


def draw_speed(rng):
    """An uneven motor: its speed over the phase."""
    step, turn, wander = rng.uniform(0.0, 0.08), rng.uniform(0.0, 0.06), rng.uniform(0.0, 0.015)
    angle = rng.uniform(0.0, 2 * np.pi, 3)
    slow = rng.uniform(0.11, 0.37)
    return lambda phase, n: (
        1.0
        + step * np.sin(2 * np.pi * n * phase + angle[0])
        + turn * np.sin(2 * np.pi * phase + angle[1])
        + wander * np.sin(2 * np.pi * slow * phase + angle[2])
    )


def steepest_deg(worm: Worm) -> float:
    """A slope that even a weakened worm climbs: 65 % of what its tips hold while one is stepping, at most 40 degrees."""
    hold = (worm.cells - 2) * worm.friction_n.mean()
    return float(min(40.0, np.degrees(np.arcsin(min(1.0, 0.65 * hold / (worm.mass_kg * GRAVITY))))))


def draw_sizes(size: str, rng) -> tuple:
    """Worm, cycle time in s, cycles and slopes in degrees of a campaign of one of the `SIZES`."""
    if size == "varied":
        worm = draw_worm(int(rng.integers(3, 9)), rng)
        cycle_s = float(0.8 * 12.5 ** rng.random())
        runs = int(rng.choice([1, 2, 2, 3, 3, 3, 3, 4, 5, 6]))
        # More short recordings than long ones.
        wished = 8.0 * 7.5 ** (rng.random() ** 2)
        cycles = round(min(wished, max(8.0, LONGEST_S / (runs * cycle_s))))
        steepest = steepest_deg(worm) * rng.uniform(0.8, 1.0)
        return worm, cycle_s, cycles, [float(round(slope)) for slope in np.linspace(0.0, steepest, runs)]
    worm = draw_worm(int(rng.choice([3, 4, 4, 4, 5, 6])), rng)
    cycle_s = float(rng.choice([2.5, 1.8 * 2.5 ** rng.random()]))
    cycles = int(rng.integers(8, 13))
    steepest = steepest_deg(worm)
    slopes = [0.0, round(steepest * rng.uniform(0.45, 0.7)), round(steepest * rng.uniform(0.8, 1.0))]
    if size == "small":
        return draw_worm(4, rng), 2.5, 6, [0.0, 30.0]
    return worm, cycle_s, cycles, slopes


# Two runs of six cycles with four cells at 2.5 s; three runs of 8 to 12 cycles; one to six runs of 8 to 60 cycles at 0.8 to 10 s.
SIZES = ("small", "usual", "varied")
# Longest simulated time over all runs where a long recording is wished for, s.
LONGEST_S = 400.0


def draw(name: str, kind: str, hide, seed: int, size: str = "usual") -> Plan:
    """Draws a campaign of one of the `SIZES`; `hide(rng, worm)` gives the list of what is hidden."""
    rng = np.random.default_rng(seed)
    worm, cycle_s, cycles, slopes = draw_sizes(size, rng)
    cells = worm.cells
    hidden = hide(rng, worm)
    needs_phase = any(each.name in effects.NEED_PHASE for each in hidden)
    least_noise_m, span = (0.02e-3, 15.0) if size == "varied" else (0.03e-3, 5.0)
    capture = Capture(
        rate_hz=float(rng.choice([60.0, 120.0, 120.0, 240.0])),
        noise_m=float(least_noise_m * span ** rng.random()),
        drift_m=float(0.01e-3 * 4.0 ** rng.random()),
        drift_s=float(0.02 * 10.0 ** rng.random()),
        dropout=0.01,
        with_phase=needs_phase or rng.random() < 0.8,
    )
    begins = [-np.inf] * len(slopes)
    if kind == "onset":
        cycle = float(rng.integers(3, min(10, cycles - 3) + 1)) + float(rng.choice([0.0, rng.random()]))
        if rng.random() < 0.3:
            # It happens once, in one run, and stays.
            run = int(rng.integers(len(slopes) - 1))
            begins = [np.inf] * run + [cycle] + [-np.inf] * (len(slopes) - run - 1)
        else:
            begins = [cycle] * len(slopes)
    motor = draw_speed(rng)
    runs = []
    for slope, begin in zip(slopes, begins):
        true_deg = slope + 0.15 * float(rng.standard_normal())
        scene = Scene(true_deg, cycle_s, cycles, 1.0 + float(rng.random()), lambda p: motor(p, cells), int(rng.integers(2**31)))
        runs.append((slope, scene, begin))
    return Plan(name, kind, seed, worm, hidden, runs, capture, cycle_s)


def _crawl(plan: Plan, hidden: list) -> list:
    """The runs with some of what is hidden."""
    runs = []
    for _, scene, begin in plan.runs:
        worm = copy.deepcopy(plan.worm)
        worm.overlap = sum(each.overlap for each in hidden)
        changes = tuple(effect for each in hidden for effect in each.on(begin))
        runs.append(simulate(worm, scene, changes))
    return runs


def _seen(run: Run, hidden: list, time_s: np.ndarray) -> tuple:
    """Noise-free positions and the phase at sample times, as an unbiased clock and a perfect camera would record them."""
    latency = sum(each.latency_s for each in hidden)
    scale = float(np.prod([each.scale for each in hidden]))
    position = np.stack([np.interp(time_s - latency, run.time_s, x) for x in run.position_m.T], axis=1)
    return np.interp(time_s, run.time_s, run.phase), scale * position


def make(plan: Plan, folder: Path, split: str) -> dict:
    """Simulates a campaign, writes it into `folder`, and returns its truth.

    Raises `CrawlFailed` where the drawn worm does not crawl.
    """
    n = plan.worm.cells
    with_it = _crawl(plan, plan.hidden)
    if plan.hidden:
        without = _crawl(plan, [])
    else:
        without = with_it
    firsts = [float(np.ceil(scene.warm_up_cycles)) for _, scene, _ in plan.runs]
    # The last whole cycle that is recorded.
    wholes = [int(np.floor(scene.warm_up_cycles + scene.cycles - first)) for (_, scene, _), first in zip(plan.runs, firsts)]
    spans = [(scene.slope_deg, first, whole, plan.cycle_s) for (_, scene, _), first, whole in zip(plan.runs, firsts, wholes)]
    # Where nothing is hidden there is nothing to detect.
    detector = Detector(plan.worm, spans, plan.capture) if plan.hidden else None
    compared = _difference(plan.hidden, with_it, without, spans, n)
    truth = {
        "bed": "mujoco",
        "mujoco": mujoco.__version__,
        "split": split,
        "case": plan.name,
        "kind": plan.kind,
        "seed": plan.seed,
        "cells": n,
        "cycle_s": plan.cycle_s,
        "rate_hz": plan.capture.rate_hz,
        "noise_m": plan.capture.noise_m,
        "with_phase": plan.capture.with_phase,
        "stranger": plan.hidden[0].name if plan.kind == "stranger" else None,
        "discrepancy_m": 0.0,
        "artefacts": [],
        "effects": [],
        "sigma": detector.sigma(compared) if detector else 0.0,
        "runs": [],
    }
    for each in plan.hidden:
        if plan.kind != "stranger":
            alone = compared
            if len(plan.hidden) > 1:
                alone = _difference([each], _crawl(plan, [each]), without, spans, n)
            truth["effects"].append(
                {
                    "name": each.name,
                    "cell": None if each.cell is None else each.cell + 1,
                    "parameters": {key: float(value) for key, value in each.parameters.items()},
                    "sigma": detector.sigma(alone),
                }
            )
        else:
            truth["stranger_parameters"] = {key: float(value) for key, value in each.parameters.items()}
    affected = 0.0
    rng = np.random.default_rng(plan.seed + 1)
    folder.mkdir(parents=True, exist_ok=True)
    for number, (stated, scene, begin) in enumerate(plan.runs):
        run, clean, first, whole = with_it[number], without[number], firsts[number], wholes[number]
        # Whole cycles after the onset count for the impact.
        count_from = first if begin == -np.inf else min(first + whole, max(first, np.ceil(scene.warm_up_cycles + begin)))
        count = int(first + whole - count_from)
        affected += count
        truth["runs"].append(
            {
                "slope_deg": stated,
                "true_slope_deg": scene.slope_deg,
                "cycles": whole,
                **_impact(run, clean, plan, count_from, count),
                "position_change_m": float(np.sqrt(np.mean(compared[number] ** 2))),
                "onset": _onset(run, scene, begin),
            }
        )
        _write_recording(folder / f"run{number + 1}.csv", run, scene, plan, rng)
    truth["sigma_per_cycle"] = truth["sigma"] / np.sqrt(max(affected, 1.0))
    (folder / "worm.toml").write_text(
        NOMINAL_TOML.format(
            cells=n, mass=round(0.333 / 4 * n, 6), order=[int(cell) + 1 for cell in plan.worm.step_order], cycle_s=plan.cycle_s
        )
    )
    lines = ['worm = "worm.toml"\n']
    for number, (stated, _, _) in enumerate(plan.runs):
        lines.append(f'[[run]]\nrecording = "run{number + 1}.csv"\nslope_deg = {stated}\ncycle_s = {plan.cycle_s}\n')
    (folder / "campaign.toml").write_text("\n".join(lines))
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
    return truth


def _difference(hidden: list, with_it: list, without: list, spans: list, cells: int) -> list:
    """What the effect does to the recorded positions at the phases of the bins: [phase, cell] for each run."""
    out = []
    droops = any(each.name == "motor-droop" for each in hidden)
    for run, clean, (_, first, cycles, _) in zip(with_it, without, spans):
        phase = Detector.bins(first, cycles, cells)
        if droops:
            # A droop shows in time only: both runs are compared at the same fraction of each cycle's time.
            one, other = (each.at(_phase_at_time_fraction(each, phase)) for each in (run, clean))
        else:
            recorded_phase, position = _seen(run, hidden, run.time_s)
            one = np.stack([np.interp(phase, recorded_phase, x) for x in position.T], axis=1)
            other = clean.at(phase)
        out.append(one - other)
    return out


def _phase_at_time_fraction(run: Run, phase: np.ndarray) -> np.ndarray:
    cycle = np.floor(phase)
    begin, end = (np.interp(at, run.phase, run.time_s) for at in (cycle, cycle + 1.0))
    return np.interp(begin + (phase - cycle) * (end - begin), run.time_s, run.phase)


def _impact(run: Run, clean: Run, plan: Plan, first: float, cycles: int) -> dict:
    """Advance and energy per cycle with the effect and without it."""
    if cycles < 1:
        nothing = dict.fromkeys(("advance_m", "baseline_advance_m", "energy_j", "baseline_energy_j"))
        return {**nothing, "advance_change": 0.0, "energy_change": 0.0}
    ends = np.array([first, first + cycles])
    scale = float(np.prod([each.scale for each in plan.hidden]))
    advance, baseline = (float(np.diff(each.at(ends).mean(axis=1))[0]) / cycles for each in (run, clean))
    energy, baseline_energy = (float(np.diff(each.work_at(ends))[0]) / cycles for each in (run, clean))
    # Near the slope of no progress percentages explode: a quarter of the stroke is the least that they refer to.
    reference = max(abs(baseline), 0.25 * float(plan.worm.stroke_m.mean()))
    return {
        "advance_m": scale * advance,
        "baseline_advance_m": baseline,
        "energy_j": energy,
        "baseline_energy_j": baseline_energy,
        "advance_change": abs(scale * advance - baseline) / reference,
        "energy_change": abs(energy - baseline_energy) / baseline_energy,
    }


def _onset(run: Run, scene: Scene, begin: float) -> dict | None:
    """Where in the recording an effect begins; none where it is there from the start or never."""
    if not np.isfinite(begin):
        return None
    phase = scene.warm_up_cycles + begin
    start_s = np.interp(scene.warm_up_cycles, run.phase, run.time_s)
    return {"gait_phase": phase, "cycle": begin, "time_s": float(np.interp(phase, run.phase, run.time_s) - start_s)}


def _write_recording(path: Path, run: Run, scene: Scene, plan: Plan, rng) -> None:
    start_s = np.interp(scene.warm_up_cycles, run.phase, run.time_s)
    last_s = run.time_s[-1]
    time_s = np.arange(0.0, last_s - start_s, 1.0 / plan.capture.rate_hz)
    phase, position = _seen(run, plan.hidden, start_s + time_s)
    seen = plan.capture.measure(position, rng)
    cells = range(1, plan.worm.cells + 1)
    header = ["time_s", *(f"x{cell}_m" for cell in cells)] + (["gait_phase"] if plan.capture.with_phase else [])
    with open(path, "w", encoding="utf-8") as file:
        file.write("# A worm in MuJoCo; SI units; empty = not seen\n" + ",".join(header) + "\n")
        for t, p, row in zip(time_s, phase, seen):
            values = [f"{t:.6f}", *("" if np.isnan(x) else f"{x:.7f}" for x in row)]
            file.write(",".join(values + ([f"{p:.6f}"] if plan.capture.with_phase else [])) + "\n")
