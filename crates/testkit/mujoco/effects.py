"""What may be hidden in the MuJoCo worm: effects that the library has a name for, and strangers that it has not.

Each changes the plant as MuJoCo offers it (friction loss, spring, damping, mass, gravity, servo gain, command), or adds a
force to a joint; none uses the formula by which the library models it. A function of this module draws an effect's severity
and returns a `Hidden`.
"""

import copy
from dataclasses import dataclass, field

import numpy as np

from worm import GRAVITY, STEP_S, Plant, Scene, Worm


class Effect:
    """An effect that begins at a gait cycle of the recording; minus infinity: it is there from the start."""

    begins_cycle = -np.inf

    def attach(self, plant: Plant, scene: Scene) -> None:
        """Called once before a run."""
        self.active = False
        self.scene = scene
        if self.begins_cycle == -np.inf:
            self.active = True
            self.begin(plant)

    def step(self, plant: Plant) -> None:
        """Called before every time step."""
        if not self.active:
            if plant.cycle < self.begins_cycle:
                return
            self.active = True
            self.begin(plant)
        self.each_step(plant)

    def begin(self, plant: Plant) -> None:
        """Changes the plant once, where the effect begins."""

    def each_step(self, plant: Plant) -> None:
        """Changes what varies; joint forces and the friction's factor start at none in every step."""


class FrictionOfCell(Effect):
    def __init__(self, cell, factor):
        self.cell, self.factor = cell, factor

    def begin(self, plant):
        plant.friction_n[self.cell] *= self.factor


class StiffnessOfCell(Effect):
    def __init__(self, cell, factor):
        self.cell, self.factor = cell, factor

    def begin(self, plant):
        plant.model.jnt_stiffness[plant.pad[self.cell]] *= self.factor


class BoundsApart(Effect):
    """Another bound backward than forward: their mean as friction loss, half their difference as a constant force on the tip."""

    def __init__(self, backward_over_forward):
        self.factor = backward_over_forward

    def begin(self, plant):
        self.push_n = 0.5 * (self.factor - 1.0) * plant.friction_n
        plant.friction_n *= 0.5 * (1.0 + self.factor)

    def each_step(self, plant):
        plant.data.qfrc_applied[plant.tip] += self.push_n


class Stribeck(Effect):
    """Friction at rest above that of a sliding tip, falling as a Gaussian of the speed that friction feels with a lag."""

    SPEED_M_S = 2.0e-3
    LAG_S = 8e-3

    def __init__(self, static_over_kinetic):
        self.excess = static_over_kinetic - 1.0

    def begin(self, plant):
        self.speed = np.zeros(plant.worm.cells)

    def each_step(self, plant):
        self.speed += (np.abs(plant.data.qvel[plant.tip]) - self.speed) * (STEP_S / self.LAG_S)
        plant.loss_factor = plant.loss_factor * (1.0 + self.excess * np.exp(-((self.speed / self.SPEED_M_S) ** 2)))


class Hardening(Effect):
    """A quintic beside the linear spring: `hardening` is the growth of the force at 1.75 mm."""

    def __init__(self, hardening):
        self.hardening = hardening

    def each_step(self, plant):
        deformation = plant.data.qpos[plant.pad]
        k = plant.worm.stiffness_n_per_m
        plant.data.qfrc_applied[plant.pad] -= k * self.hardening * deformation * (deformation / 1.75e-3) ** 4


class Creep(Effect):
    """Two Maxwell branches beside the pad's spring, their time constants a factor of 2.5 apart."""

    def __init__(self, share, time_s):
        self.share, self.times_s = share, (time_s / 1.58, time_s * 1.58)

    def begin(self, plant):
        self.relaxed = [plant.data.qpos[plant.pad].copy() for _ in self.times_s]

    def each_step(self, plant):
        deformation = plant.data.qpos[plant.pad]
        for relaxed, time_s in zip(self.relaxed, self.times_s):
            relaxed += (deformation - relaxed) * (STEP_S / time_s)
            plant.data.qfrc_applied[plant.pad] -= 0.5 * self.share * plant.worm.stiffness_n_per_m * (deformation - relaxed)


class BoucWen(Effect):
    """A share of the pad's stiffness that yields smoothly, after Bouc and Wen (exponent 1)."""

    def __init__(self, share, yield_share):
        self.share, self.yield_share = share, yield_share

    def begin(self, plant):
        k = plant.model.jnt_stiffness
        self.k = self.share * k[plant.pad]
        k[plant.pad] -= self.k
        self.yield_m = self.yield_share * plant.friction_n / plant.worm.stiffness_n_per_m
        self.bend = plant.data.qpos[plant.pad].clip(-self.yield_m, self.yield_m)

    def each_step(self, plant):
        move = plant.data.qvel[plant.pad] * STEP_S
        load = np.where(move * self.bend > 0.0, np.abs(self.bend) / self.yield_m, 0.0)
        self.bend += move * (1.0 - load)
        plant.data.qfrc_applied[plant.pad] -= self.k * self.bend


class CellDrag(Effect):
    """Damping of each cell against the canal."""

    def __init__(self, drag_n_s_per_m):
        self.drag = drag_n_s_per_m

    def begin(self, plant):
        plant.model.tendon_damping[plant.place] += self.drag


class ForceOnWorm(Effect):
    """A force that holds the worm back, shared by its cells: a function of its displacement since the camera was switched on."""

    def __init__(self, force):
        self.force = force

    def begin(self, plant):
        self.from_m = None

    def each_step(self, plant):
        place = np.mean(plant.data.qpos[plant.tip] + plant.data.qpos[plant.pad])
        if self.from_m is None or plant.cycle < 0.0:
            self.from_m = place
        force = self.force(place - self.from_m, plant) / plant.worm.cells
        plant.data.qfrc_applied[plant.pad] -= force
        plant.data.qfrc_applied[plant.tip] -= force


class Weight(Effect):
    """More mass on every cell, with its inertia."""

    def __init__(self, mass_kg):
        self.mass_kg = mass_kg

    def begin(self, plant):
        plant.model.body_mass[plant.cell_body] += self.mass_kg / plant.worm.cells
        plant.set_constants()


class Tilt(Effect):
    """Gravity at another angle."""

    def __init__(self, angle_deg):
        self.angle_deg = angle_deg

    def begin(self, plant):
        plant.set_slope(self.scene.slope_deg + self.angle_deg)


class StrokeOf(Effect):
    """`factor(cell, cycle)` on each stroke, by the cycle in which it begins, the warm-up counted."""

    def __init__(self, factor):
        self.factor = factor

    def attach(self, plant, scene):
        super().attach(plant, scene)
        # When in the cycle each cell steps.
        self.place = np.argsort(plant.worm.step_order) / plant.worm.cells

    def stroke(self, cell, cycle):
        since = cycle + self.place[cell] - self.scene.warm_up_cycles
        return self.factor(cell, cycle) if since >= self.begins_cycle else 1.0


class SoftServo(Effect):
    """A servo that gives way: its gain is one over the compliance that it adds to its own.

    Its damping falls with the gain, for else it would follow the cam later, too, and that is an effect of another name.
    """

    def __init__(self, compliance_m_per_n):
        self.compliance = compliance_m_per_n

    def begin(self, plant):
        gain = 1.0 / (1.0 / plant.worm.servo_n_per_m + self.compliance)
        plant.model.actuator_gainprm[:, 0] = gain
        plant.model.actuator_biasprm[:, 1] = -gain
        plant.model.actuator_biasprm[:, 2] *= gain / plant.worm.servo_n_per_m


class Play(Effect):
    """A dead zone between each servo and its cell: inside it, the servo's command is where the cell is."""

    def __init__(self, play_m):
        self.half_m = 0.5 * play_m

    def command(self, plant):
        if not self.active:
            return
        at = plant.data.ten_length[plant.held]
        away = plant.data.ctrl - at
        plant.data.ctrl[:] = at + away - np.clip(away, -self.half_m, self.half_m)


class FrictionAlongCanal(Effect):
    """A factor on each tip's friction that depends on where it touches the canal."""

    def __init__(self, factor):
        self.factor = factor

    def each_step(self, plant):
        plant.loss_factor = plant.loss_factor * self.factor(plant.tip_place_m())


class FrictionInTime(Effect):
    """A factor on all friction that depends on the cycles since the camera was switched on."""

    def __init__(self, factor):
        self.factor = factor

    def each_step(self, plant):
        plant.loss_factor = plant.loss_factor * self.factor(max(plant.cycle, 0.0))


class FrictionOnSlope(Effect):
    def __init__(self, sensitivity):
        self.sensitivity = sensitivity

    def begin(self, plant):
        plant.friction_n *= 1.0 - self.sensitivity * (1.0 - np.cos(np.radians(self.scene.slope_deg)))


class Droop(Effect):
    """A motor that slows down under the stepping cell's load."""

    def __init__(self, slowdown_per_n):
        self.slowdown = slowdown_per_n

    def pace(self, plant):
        if not self.active:
            return 1.0
        load = float(np.max(plant.data.actuator_force))
        return min(max(1.0 - self.slowdown * load, 0.2), 1.5)


class SwayingGravity(Effect):
    """The canal's angle swings, out of step with the gait."""

    def __init__(self, amplitude_m_s2, period_s, angle_rad):
        self.amplitude, self.period_s, self.angle = amplitude_m_s2, period_s, angle_rad

    def each_step(self, plant):
        gravity = -GRAVITY * np.sin(np.radians(self.scene.slope_deg))
        plant.model.opt.gravity[0] = gravity + self.amplitude * np.sin(2 * np.pi * plant.time_s / self.period_s + self.angle)


class DampedPad(Effect):
    """Pads with far more damping than a clean worm's."""

    def __init__(self, damping_n_s_per_m):
        self.damping = damping_n_s_per_m

    def begin(self, plant):
        plant.model.dof_damping[plant.pad] += self.damping


class BentCanal(Effect):
    """The slope changes along the canal: each cell's weight by its place."""

    def __init__(self, degrees_per_m):
        self.rad_per_m = np.radians(degrees_per_m)

    def each_step(self, plant):
        slope = np.radians(self.scene.slope_deg)
        place = plant.data.qpos[plant.tip] - 0.0
        ahead = place + plant.worm.spacing_m * (np.arange(plant.worm.cells)[::-1] - 0.5 * (plant.worm.cells - 1))
        cell_kg = plant.worm.mass_kg / plant.worm.cells
        plant.data.qfrc_applied[plant.tip] -= cell_kg * GRAVITY * (np.sin(slope + self.rad_per_m * ahead) - np.sin(slope))
        plant.data.qfrc_applied[plant.pad] -= cell_kg * GRAVITY * (np.sin(slope + self.rad_per_m * ahead) - np.sin(slope))


class TwoSidedPad(Effect):
    """Pads softer when pulled than when pushed."""

    def __init__(self, factor):
        self.factor = factor

    def each_step(self, plant):
        deformation = plant.data.qpos[plant.pad]
        plant.data.qfrc_applied[plant.pad] += (1.0 - self.factor) * plant.worm.stiffness_n_per_m * np.minimum(deformation, 0.0)


class SlackPad(Effect):
    """Pads with a free travel about their middle in which they give no force."""

    def __init__(self, slack_m):
        self.half_m = 0.5 * slack_m

    def each_step(self, plant):
        deformation = plant.data.qpos[plant.pad]
        plant.data.qfrc_applied[plant.pad] += plant.worm.stiffness_n_per_m * np.clip(deformation, -self.half_m, self.half_m)


class AgingTip(Effect):
    """Friction grows with the logarithm of the time that a tip has rested."""

    def __init__(self, per_decade):
        self.per_decade = per_decade

    def begin(self, plant):
        self.rested_s = np.zeros(plant.worm.cells)

    def each_step(self, plant):
        moves = np.abs(plant.data.qvel[plant.tip]) > 0.3e-3
        self.rested_s = np.where(moves, 0.97 * self.rested_s, self.rested_s + STEP_S)
        plant.loss_factor = plant.loss_factor * (1.0 + self.per_decade * np.log10(1.0 + self.rested_s / 0.02))


class SofteningPads(Effect):
    """Pads that lose stiffness towards an asymptote as they warm up."""

    def __init__(self, loss, cycles):
        self.loss, self.cycles = loss, cycles

    def begin(self, plant):
        self.k = plant.model.jnt_stiffness[plant.pad].copy()

    def each_step(self, plant):
        plant.model.jnt_stiffness[plant.pad] = self.k * (1.0 - self.loss * (1.0 - np.exp(-max(plant.cycle, 0.0) / self.cycles)))


class Fading(Effect):
    """Friction of one cell that comes and goes with a period of several cycles."""

    def __init__(self, cell, share, period_cycles, angle):
        self.cell, self.share, self.period, self.angle = cell, share, period_cycles, angle

    def each_step(self, plant):
        factor = np.ones(plant.worm.cells)
        factor[self.cell] += self.share * np.sin(2 * np.pi * max(plant.cycle, 0.0) / self.period + self.angle)
        plant.loss_factor = plant.loss_factor * factor


@dataclass
class Hidden:
    """What is hidden in one worm, and how it is called."""

    name: str
    effects: tuple
    # From 0.
    cell: int | None = None
    parameters: dict = field(default_factory=dict)
    # Recorded positions over true ones, and their age, s.
    scale: float = 1.0
    latency_s: float = 0.0
    # A share of a step by which each cell begins early: part of the command, and so of the worm.
    overlap: float = 0.0

    def on(self, begins_cycle: float) -> tuple:
        """Its effects for a run in which it begins at a cycle of the recording; infinity: not at all."""
        if begins_cycle == np.inf:
            return ()
        effects = copy.deepcopy(self.effects)
        for effect in effects:
            effect.begins_cycle = begins_cycle
        return effects


def _log_uniform(rng, low, high):
    return low * (high / low) ** rng.random()


def _either_way(rng, low, high):
    away = _log_uniform(rng, low, high)
    return 1.0 - away if rng.random() < 0.5 else 1.0 + away


def _smooth_patch(from_m, length_m, factor):
    edge = 1.5e-3
    begun = lambda place: 0.5 * (1 + np.tanh((place - from_m) / edge))
    ended = lambda place: 0.5 * (1 + np.tanh((place - from_m - length_m) / edge))
    return lambda place: 1.0 - (1.0 - factor) * begun(place) * (1.0 - ended(place))


# How far a worm crawls, for effects that depend on it.
DISTANCE_M = 0.06


def _unequal_clamping(rng, worm):
    cell, factor = int(rng.integers(worm.cells)), _either_way(rng, 0.08, 0.5)
    return Hidden("unequal-clamping", (FrictionOfCell(cell, factor),), cell, {"friction_factor": factor})


def _unequal_stiffness(rng, worm):
    cell, factor = int(rng.integers(worm.cells)), _either_way(rng, 0.1, 0.5)
    return Hidden("unequal-stiffness", (StiffnessOfCell(cell, factor),), cell, {"stiffness_factor": factor})


def _directional_friction(rng, worm):
    factor = _either_way(rng, 0.06, 0.4)
    return Hidden("directional-friction", (BoundsApart(factor),), None, {"backward_over_forward": factor})


def _breakaway_friction(rng, worm):
    ratio = 1.0 + _log_uniform(rng, 0.1, 0.6)
    return Hidden("breakaway-friction", (Stribeck(ratio),), None, {"static_over_kinetic": ratio})


def _pad_hardening(rng, worm):
    hardening = _log_uniform(rng, 0.15, 1.2)
    return Hidden("pad-hardening", (Hardening(hardening),), None, {"hardening": hardening})


def _pad_creep(rng, worm):
    share, time_s = _log_uniform(rng, 0.15, 1.2), _log_uniform(rng, 0.15, 2.0)
    return Hidden("pad-creep", (Creep(share, time_s),), None, {"creep_share": share, "time_constant_s": time_s})


def _pad_hysteresis(rng, worm):
    share = _log_uniform(rng, 0.15, 0.7)
    return Hidden("pad-hysteresis", (BoucWen(share, 0.5),), None, {"yielding_share": share})


def _viscous_drag(rng, worm):
    drag = _log_uniform(rng, 2.0, 25.0)
    return Hidden("viscous-drag", (CellDrag(drag),), None, {"drag_n_s_per_m": drag})


def _constant_drag(rng, worm):
    force = _log_uniform(rng, 0.05, 0.7)
    return Hidden("constant-drag", (ForceOnWorm(lambda _m, _plant, f=force: f),), None, {"force_n": force})


def _payload(rng, worm):
    mass = _log_uniform(rng, 0.01, 0.12)
    return Hidden("payload", (Weight(mass),), None, {"mass_kg": mass})


def _slope_error(rng, worm):
    angle = _log_uniform(rng, 0.5, 3.5) * rng.choice([-1.0, 1.0])
    return Hidden("slope-error", (Tilt(angle),), None, {"angle_deg": angle})


def _tether_drag(rng, worm):
    per_m = _log_uniform(rng, 0.1, 0.9) / DISTANCE_M
    force = lambda displacement_m, _plant, k=per_m: k * max(displacement_m, 0.0)
    return Hidden("tether-drag", (ForceOnWorm(force),), None, {"force_per_distance_n_per_m": per_m})


def _lost_stroke(rng, worm):
    if rng.random() < 0.5:
        cell, lost = int(rng.integers(worm.cells)), _log_uniform(rng, 0.02, 0.12)
        factor = lambda each, _cycle, c=cell, s=lost: 1.0 - s if each == c else 1.0
        return Hidden("lost-stroke", (StrokeOf(factor),), cell, {"lost_share": lost})
    lost = _log_uniform(rng, 0.04, 0.13)
    return Hidden("lost-stroke", (StrokeOf(lambda _cell, _cycle, s=lost: 1.0 - s),), None, {"lost_share": lost})


def _actuator_compliance(rng, worm):
    compliance = _log_uniform(rng, 2e-5, 3e-4)
    return Hidden("actuator-compliance", (SoftServo(compliance),), None, {"compliance_m_per_n": compliance})


def _backlash(rng, worm):
    play = _log_uniform(rng, 0.1e-3, 1e-3)
    return Hidden("backlash", (Play(play),), None, {"play_m": play})


def _step_overlap(rng, worm):
    overlap = _log_uniform(rng, 0.04, 0.3)
    return Hidden("step-overlap", (), None, {"overlap": overlap}, overlap=overlap)


def _slick_patch(rng, worm):
    length = rng.uniform(0.015, 0.05)
    start = rng.uniform(-0.005, 0.03) + worm.spacing_m * rng.integers(worm.cells)
    factor = 1.0 - _log_uniform(rng, 0.15, 0.7)
    parameters = {"friction_factor": factor, "from_m": start, "length_m": length}
    return Hidden("slick-patch", (FrictionAlongCanal(_smooth_patch(start, length, factor)),), None, parameters)


def _wear(rng, worm):
    loss = _log_uniform(rng, 0.003, 0.03)
    if rng.random() < 0.5:
        law = lambda cycles, s=loss: np.exp(-s * cycles)
    else:
        # In steps of two cycles.
        law = lambda cycles, s=loss: 1.0 - s * 2.0 * np.floor(cycles / 2.0 + 0.5)
    return Hidden("wear", (FrictionInTime(law),), None, {"loss_per_cycle": loss})


def _motor_droop(rng, worm):
    slowdown = _log_uniform(rng, 0.02, 0.2)
    return Hidden("motor-droop", (Droop(slowdown),), None, {"slowdown_per_n": slowdown})


def _slope_clamping(rng, worm):
    sensitivity = _log_uniform(rng, 0.15, 1.0)
    return Hidden("slope-clamping", (FrictionOnSlope(sensitivity),), None, {"sensitivity": sensitivity})


def _sensor_scale(rng, worm):
    scale = _either_way(rng, 0.04, 0.12)
    return Hidden("sensor-scale", (), None, {"scale": scale}, scale=scale)


def _sensor_latency(rng, worm):
    latency = _log_uniform(rng, 0.008, 0.06)
    return Hidden("sensor-latency", (), None, {"latency_s": latency}, latency_s=latency)


LIBRARY = {
    "unequal-clamping": _unequal_clamping,
    "unequal-stiffness": _unequal_stiffness,
    "directional-friction": _directional_friction,
    "breakaway-friction": _breakaway_friction,
    "pad-hardening": _pad_hardening,
    "pad-creep": _pad_creep,
    "pad-hysteresis": _pad_hysteresis,
    "viscous-drag": _viscous_drag,
    "constant-drag": _constant_drag,
    "payload": _payload,
    "slope-error": _slope_error,
    "tether-drag": _tether_drag,
    "lost-stroke": _lost_stroke,
    "actuator-compliance": _actuator_compliance,
    "backlash": _backlash,
    "step-overlap": _step_overlap,
    "slick-patch": _slick_patch,
    "wear": _wear,
    "motor-droop": _motor_droop,
    "slope-clamping": _slope_clamping,
    "sensor-scale": _sensor_scale,
    "sensor-latency": _sensor_latency,
}
# Seen only where the cam's phase is recorded.
NEED_PHASE = ("sensor-latency", "motor-droop", "backlash")
# What can begin in mid-run.
WITH_ONSET = (
    "unequal-clamping",
    "unequal-stiffness",
    "constant-drag",
    "lost-stroke",
    "payload",
    "directional-friction",
    "viscous-drag",
)


def _swaying_gravity(rng, worm):
    amplitude, period = _log_uniform(rng, 0.5, 1.5), rng.uniform(0.9, 4.0)
    sway = SwayingGravity(amplitude, period, rng.uniform(0, 6.28))
    return Hidden("swaying-gravity", (sway,), None, {"amplitude_m_s2": amplitude, "period_s": period})


def _damped_pad(rng, worm):
    damping = _log_uniform(rng, 80.0, 400.0)
    return Hidden("damped-pad", (DampedPad(damping),), None, {"damping_n_s_per_m": damping})


def _bent_canal(rng, worm):
    bend = _log_uniform(rng, 60.0, 200.0) * rng.choice([-1.0, 1.0])
    return Hidden("bent-canal", (BentCanal(bend),), None, {"degrees_per_m": bend})


def _alternating_stroke(rng, worm):
    share = _log_uniform(rng, 0.02, 0.08)
    factor = lambda _cell, cycle, s=share: 1.0 + (s if cycle % 2 else -s)
    return Hidden("alternating-stroke", (StrokeOf(factor),), None, {"share": share})


def _two_sided_pad(rng, worm):
    factor = 1.0 - _log_uniform(rng, 0.15, 0.6)
    return Hidden("two-sided-pad", (TwoSidedPad(factor),), None, {"stiffness_factor": factor})


def _warming_tips(rng, worm):
    gain, cycles = _log_uniform(rng, 0.1, 0.4), rng.uniform(0.5, 2.0)
    law = lambda c, g=gain, t=cycles: 1.0 + g * np.exp(-c / t)
    return Hidden("warming-tips", (FrictionInTime(law),), None, {"gain": gain, "cycles": cycles})


def _tugging_cable(rng, worm):
    force, period, angle = _log_uniform(rng, 0.15, 0.6), rng.uniform(0.7, 6.0), rng.uniform(0, 6.28)
    law = lambda _m, plant, f=force, p=period, a=angle: f * max(0.0, np.sin(2 * np.pi * plant.time_s / p + a)) ** 3
    return Hidden("tugging-cable", (ForceOnWorm(law),), None, {"force_n": force, "period_s": period})


def _washboard(rng, worm):
    share, period, angle = _log_uniform(rng, 0.1, 0.4), rng.uniform(0.004, 0.013), rng.uniform(0, 6.28)
    law = lambda place, s=share, p=period, a=angle: 1.0 + s * np.sin(2 * np.pi * place / p + a)
    return Hidden("washboard", (FrictionAlongCanal(law),), None, {"share": share, "period_m": period})


def _slack_pad(rng, worm):
    slack = _log_uniform(rng, 0.15e-3, 0.9e-3)
    return Hidden("slack-pad", (SlackPad(slack),), None, {"slack_m": slack})


def _aging_tip(rng, worm):
    per_decade = _log_uniform(rng, 0.05, 0.25)
    return Hidden("aging-tip", (AgingTip(per_decade),), None, {"per_decade": per_decade})


def _softening_pads(rng, worm):
    loss, cycles = _log_uniform(rng, 0.1, 0.35), rng.uniform(2.0, 5.0)
    return Hidden("softening-pads", (SofteningPads(loss, cycles),), None, {"loss": loss, "cycles": cycles})


def _fading_cell(rng, worm):
    cell, share, period = int(rng.integers(worm.cells)), _log_uniform(rng, 0.2, 0.6), rng.uniform(2.5, 5.5)
    fading = Fading(cell, share, period, rng.uniform(0, 6.28))
    return Hidden("fading-cell", (fading,), None, {"cell": cell, "share": share, "period_cycles": period})


# Disjoint: what is learned on the strangers of one split must hold on those of the other.
STRANGERS = {
    "development": {
        "swaying-gravity": _swaying_gravity,
        "damped-pad": _damped_pad,
        "bent-canal": _bent_canal,
        "alternating-stroke": _alternating_stroke,
        "two-sided-pad": _two_sided_pad,
        "warming-tips": _warming_tips,
    },
    "sealed": {
        "tugging-cable": _tugging_cable,
        "washboard": _washboard,
        "slack-pad": _slack_pad,
        "aging-tip": _aging_tip,
        "softening-pads": _softening_pads,
        "fading-cell": _fading_cell,
    },
}
