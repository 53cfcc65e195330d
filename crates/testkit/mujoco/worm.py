"""A worm in MuJoCo, which shares nothing with the model that is judged by it.

Every cell is two bodies on the canal's axis: a tip on a slide joint whose `frictionloss` is the tip's dry friction, and on
it the cell on a second slide joint whose stiffness is the pad's. One further coordinate, free and nearly without mass,
stands for the cam: a position servo on a fixed tendon holds each cell at its commanded distance from it. Gravity is tilted
by the slope.

    canal ──frictionloss── tip 1 ──spring── cell 1 ──servo──┐
    canal ──frictionloss── tip 2 ──spring── cell 2 ──servo──┼── cam (free)
    ...                                                     │

SI units throughout; the canal's direction is x, up the canal positive.
"""

from dataclasses import dataclass
from typing import Callable

import mujoco
import numpy as np

GRAVITY = 9.81
# With steps of 0.2 ms and servos damped by 200 N s/m, a worm at 0.9 s a cycle is wrong by 33 micrometres; with these, by 7.
STEP_S = 0.1e-3
# The finest record that is kept: noise-free positions every so many steps.
RECORD_EVERY = 10
CAM_MASS_KG = 1e-3
# The impedance nearest to a rigid constraint that MuJoCo allows.
RIGID_IMPEDANCE = "0.9999 0.9999 0.001"


class CrawlFailed(Exception):
    """The worm slid down the canal or the simulation became unstable."""


@dataclass
class Worm:
    """Parameters of a worm; one value for each cell where it is an array."""

    mass_kg: float
    friction_n: np.ndarray
    stiffness_n_per_m: np.ndarray
    stroke_m: np.ndarray
    # Damping of each pad, N s/m.
    damping_n_s_per_m: np.ndarray
    servo_n_per_m: np.ndarray
    # Damping of each servo, N s/m.
    servo_n_s_per_m: float
    # Fraction of a step in which a cell is accelerated, and again in which it is stopped.
    rounding: float
    # How much of its step a cell begins early, as a fraction.
    overlap: float
    spacing_m: float
    # Cells from 0, in the order in which they step.
    step_order: np.ndarray
    # Viscous drag on each cell, N s/m.
    drag_n_s_per_m: float = 0.0
    # Standard deviation of each tip's friction from cycle to cycle, relative.
    scatter: float = 0.0
    # Inertia of a tip, without weight: all of a cell's weight pulls at its pad, as in the theory.
    tip_kg: float = 0.004
    # MuJoCo's friction is a soft constraint: a loaded tip creeps, at a speed that this scales. At 1 it is MuJoCo's own for
    # a tip of this mass, some 20 micrometres a second near the bound.
    softness: float = 0.2
    solreffriction: str = "0.001 1"

    @property
    def cells(self) -> int:
        return len(self.friction_n)

    @staticmethod
    def nominal(cells: int = 4) -> "Worm":
        """The worm of Zarrouk, Sharf and Shoham 2016, Table 1."""
        each = np.ones(cells)
        return Worm(
            mass_kg=0.333 / 4 * cells,
            friction_n=980.0 * 1.75e-3 * each,
            stiffness_n_per_m=980.0 * each,
            stroke_m=0.0115 * each,
            damping_n_s_per_m=10.0 * each,
            servo_n_per_m=300_000.0 * each,
            servo_n_s_per_m=60.0,
            rounding=0.01,
            overlap=0.0,
            spacing_m=0.040,
            step_order=np.arange(cells),
        )

    def extensions_m(self, phase: np.ndarray, stroke: Callable | None = None) -> np.ndarray:
        """Commanded distance of each cell from the cam, less the spacing, at each phase (cycles): [sample, cell].

        A cell's step is linear in the phase but for parabolic ends. `stroke(cell, cycle)` is a factor on the stroke of one
        cell in one cycle.
        """
        n = self.cells
        out = np.empty((len(phase), n))
        for place, cell in enumerate(self.step_order):
            # Step time since the cell's step in this cycle, in steps.
            since = phase * n - place + self.overlap
            cycle = np.floor(since / n)
            u = np.clip((since - cycle * n) / (1.0 + self.overlap), 0.0, 1.0)
            if stroke is None:
                done, factor = cycle, 1.0
            else:
                first, last = int(cycle.min()), int(cycle.max())
                factors = np.array([stroke(cell, each) for each in range(first, last + 1)])
                before = np.concatenate([[0.0], np.cumsum(factors)]) + first
                done = before[(cycle - first).astype(int)]
                factor = factors[(cycle - first).astype(int)]
            out[:, cell] = self.stroke_m[cell] * (done + factor * rounded_ramp(u, self.rounding))
        return out


def rounded_ramp(u: np.ndarray, rounding: float) -> np.ndarray:
    """A ramp from 0 to 1 of constant acceleration over a fraction at either end."""
    if rounding <= 0.0:
        return u
    r, top = rounding, 1.0 / (1.0 - rounding)
    begin, end = 0.5 * top * u**2 / r, 1.0 - 0.5 * top * (1.0 - u) ** 2 / r
    return np.where(u < r, begin, np.where(u > 1.0 - r, end, top * (u - 0.5 * r)))


@dataclass
class Run:
    """Noise-free record of one run."""

    time_s: np.ndarray
    phase: np.ndarray
    # [sample, cell]
    position_m: np.ndarray
    # Positive work of the servos since the start, J.
    work_j: np.ndarray

    def at(self, phase: np.ndarray) -> np.ndarray:
        """Positions at phases: [phase, cell]."""
        return np.stack([np.interp(phase, self.phase, x) for x in self.position_m.T], axis=1)

    def work_at(self, phase: np.ndarray) -> np.ndarray:
        return np.interp(phase, self.phase, self.work_j)


class Plant:
    """The compiled worm on one slope, and what a hidden effect may change in every step."""

    def __init__(self, worm: Worm, slope_deg: float):
        self.worm = worm
        n = worm.cells
        self.model = mujoco.MjModel.from_xml_string(mjcf(worm))
        self.data = mujoco.MjData(self.model)
        self.set_slope(slope_deg)
        self.soften()
        # Qpos: the cam, then tip and pad of each cell.
        self.tip = 1 + 2 * np.arange(n)
        self.pad = 2 + 2 * np.arange(n)
        self.cell_body = 3 + 2 * np.arange(n)
        # Tendons: each cell against the cam, and against the canal.
        self.held = 2 * np.arange(n)
        self.place = self.held + 1
        self.friction_n = worm.friction_n.copy()
        # Factor on all friction in this time step, or one for each cell.
        self.loss_factor = 1.0
        # Cycle of gait since the camera was switched on; negative before.
        self.cycle = 0.0
        self.time_s = 0.0
        self.phase = 0.0

    def set_slope(self, slope_deg: float) -> None:
        angle = np.radians(slope_deg)
        self.model.opt.gravity[:] = (-GRAVITY * np.sin(angle), 0.0, -GRAVITY * np.cos(angle))

    def soften(self) -> None:
        """Scales the regularisation of the tips' friction, which MuJoCo takes from their inverse inertia."""
        self.model.dof_invweight0[1 + 2 * np.arange(self.worm.cells)] *= self.worm.softness

    def set_constants(self) -> None:
        """Makes what MuJoCo derives from the masses agree with them again."""
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        self.soften()

    def tip_place_m(self) -> np.ndarray:
        """Where each tip touches the canal; cell 1 was laid down at the spacing times the number of cells behind it."""
        return self.data.qpos[self.tip] + self.worm.spacing_m * np.arange(self.worm.cells)[::-1]


def mjcf(worm: Worm) -> str:
    """The model as MJCF."""
    cell_kg = worm.mass_kg / worm.cells
    bodies, tendons, servos = [], [], []
    for i in range(worm.cells):
        bodies.append(
            f'<body gravcomp="1"><inertial pos="0 0 0" mass="{worm.tip_kg}" diaginertia="1e-6 1e-6 1e-6"/>'
            f'<joint name="tip{i}" type="slide" axis="1 0 0" frictionloss="{worm.friction_n[i]}" '
            f'solreffriction="{worm.solreffriction}" solimpfriction="{RIGID_IMPEDANCE}"/>'
            f'<body><inertial pos="0 0 0" mass="{cell_kg}" diaginertia="1e-6 1e-6 1e-6"/>'
            f'<joint name="pad{i}" type="slide" axis="1 0 0" stiffness="{worm.stiffness_n_per_m[i]}" '
            f'damping="{worm.damping_n_s_per_m[i]}"/></body></body>'
        )
        place = f'<joint joint="tip{i}" coef="1"/><joint joint="pad{i}" coef="1"/>'
        tendons.append(
            f'<fixed name="held{i}">{place}<joint joint="cam" coef="-1"/></fixed>'
            f'<fixed name="place{i}" damping="{worm.drag_n_s_per_m}">{place}</fixed>'
        )
        servos.append(f'<position tendon="held{i}" kp="{worm.servo_n_per_m[i]}" kv="{worm.servo_n_s_per_m}"/>')
    return (
        f'<mujoco><option timestep="{STEP_S}" integrator="implicitfast" iterations="50" tolerance="1e-12">'
        '<flag contact="disable"/></option><worldbody>'
        f'<body gravcomp="1"><inertial pos="0 0 0" mass="{CAM_MASS_KG}" diaginertia="1e-6 1e-6 1e-6"/>'
        '<joint name="cam" type="slide" axis="1 0 0"/></body>'
        f'{"".join(bodies)}</worldbody><tendon>{"".join(tendons)}</tendon><actuator>{"".join(servos)}</actuator></mujoco>'
    )


@dataclass
class Scene:
    """How one run is made."""

    slope_deg: float
    cycle_s: float
    cycles: int
    # Gait cycles before the camera is switched on.
    warm_up_cycles: float = 1.0
    # Relative speed of the motor against the phase: `speed(phase)`, mean 1.
    speed: Callable[[np.ndarray], np.ndarray] | None = None
    seed: int = 1


def simulate(worm: Worm, scene: Scene, effects: tuple = ()) -> Run:
    """Crawls; `effects` are called as `effect.step(plant)` before each time step, and `effect.attach(plant, scene)` once.

    Raises `CrawlFailed` where the worm does not hold.
    """
    plant = Plant(worm, scene.slope_deg)
    model, data = plant.model, plant.data
    n = worm.cells
    end = scene.warm_up_cycles + scene.cycles
    settle_steps = round(0.2 / STEP_S)

    # The phase at each step: the motor's speed integrated, then each cell's command.
    coarse = np.linspace(0.0, end + 1.0, 4000 * int(end + 2))
    slowness = np.ones_like(coarse) if scene.speed is None else 1.0 / scene.speed(coarse)
    time_at = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(coarse))]) * scene.cycle_s
    steps = int(np.ceil(np.interp(end, coarse, time_at) / STEP_S)) + 2
    phase = np.interp(np.arange(steps) * STEP_S, time_at, coarse)
    for effect in effects:
        effect.attach(plant, scene)
    stroke = next((effect.stroke for effect in effects if hasattr(effect, "stroke")), None)
    table = worm.extensions_m(phase, stroke)
    table -= table[0]
    load_driven = next((effect for effect in effects if hasattr(effect, "pace")), None)
    stepping = [effect.step for effect in effects if hasattr(effect, "step")]
    commanding = [effect.command for effect in effects if hasattr(effect, "command")]

    rng = np.random.default_rng(scene.seed)
    scatter = 1.0 + worm.scatter * rng.standard_normal((int(end) + 2, n))

    records = []
    work, wait = 0.0, settle_steps
    step, position, cycle_before = 0, 0.0, -1
    ctrl, force, velocity = data.ctrl, data.actuator_force, data.actuator_velocity
    loss, applied, qpos = model.dof_frictionloss, data.qfrc_applied, data.qpos
    tip, pad = plant.tip, plant.pad
    moving = bool(stepping) or bool(commanding)
    forward = mujoco.mj_step
    while True:
        # With an even pace the phase is a table; a motor that feels its load walks through it at its own speed.
        if load_driven is not None:
            index = min(int(position), steps - 2)
            part = position - index
            here = phase[index] + part * (phase[index + 1] - phase[index])
            ctrl[:] = table[index] + part * (table[index + 1] - table[index])
        else:
            here = phase[step]
            ctrl[:] = table[step]
        if here >= end:
            break
        cycle = int(here)
        if cycle != cycle_before:
            cycle_before = cycle
            loss[tip] = plant.friction_n * scatter[cycle]
        if moving:
            plant.phase, plant.cycle, plant.time_s = here, here - scene.warm_up_cycles, step * STEP_S
            if stepping:
                applied[:] = 0.0
                plant.loss_factor = 1.0
                for each in stepping:
                    each(plant)
                loss[tip] = plant.friction_n * scatter[cycle] * plant.loss_factor
            for each in commanding:
                each(plant)
        forward(model, data)
        if wait > 0:
            # Laid down: the worm rests before its first step.
            wait -= 1
            continue
        power = float(force @ velocity)
        if power > 0.0:
            work += power * STEP_S
        if step % RECORD_EVERY == 0:
            records.append((step * STEP_S, here, work, *(qpos[tip] + qpos[pad])))
        if load_driven is not None:
            position += load_driven.pace(plant)
        step += 1
        if step > 20 * steps:
            raise CrawlFailed("the motor does not reach its last phase")
    out = np.array(records)
    if not np.all(np.isfinite(out)):
        raise CrawlFailed("the simulation is unstable")
    place = out[:, 3:] + worm.spacing_m * np.arange(n)[::-1]
    if out[-1, 3:].mean() < -0.2 * worm.stroke_m.mean() * end:
        raise CrawlFailed(f"the worm slides down a slope of {scene.slope_deg} degrees")
    # The command at a step is reached at its end.
    return Run(out[:, 0], out[:, 1], place, out[:, 2])
