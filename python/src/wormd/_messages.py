"""The messages on the topics of a worm, and their enumerations.

Made by generate.py from `wormd topics --json`, version 0.1.0; do not edit.

Numbers that are not known are NaN; what may be missing is None. Tuples over cells are as long as there are cells, and
cell 1 of the paper is index 0. Times are nanoseconds of CLOCK_MONOTONIC.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import ClassVar

from ._codes import Code
from ._topic import Memory, Message, Topic, text

VERSION = "0.1.0"
"""Version of wormd that these messages are of."""

MAX_CELLS = 16
_NONE = 0xFFFFFFFF


class Mode(Code):
    """The state of the controller's state machine."""

    DISARMED = "disarmed", 0
    """No torque; the cam can be turned by hand."""
    ARMED = "armed", 1
    """Torque on, goal velocity zero, ready to crawl."""
    CRAWLING = "crawling", 2
    """The cam turns at the commanded speed."""
    HOLDING = "holding", 3
    """The cam is actively kept at the angle it had when the hold began."""
    STOPPING = "stopping", 4
    """The speed ramps down; torque goes off when the cam stands still."""
    FAULT = "fault", 5
    """A safety rule stopped the worm; the reason is latched until a reset."""


class Fault(Code):
    """Why the controller is in Mode.Fault: the first reason, latched."""

    NONE = "none", 0
    """No fault."""
    LINK_LOST = "link-lost", 1
    """The servo did not answer for longer than the configured time."""
    TRACKER_STALE = "tracker-stale", 2
    """The tracker gave no new sample for longer than the configured time."""
    ESTIMATOR_SILENT = "estimator-silent", 3
    """The estimator was silent for longer than the configured time."""
    OVER_CURRENT = "over-current", 4
    """The motor current stayed above its limit."""
    OVER_TEMPERATURE = "over-temperature", 5
    """The servo is hotter than its limit."""
    UNDER_VOLTAGE = "under-voltage", 6
    """The bus voltage fell below its limit."""
    SERVO_HARDWARE = "servo-hardware", 7
    """The servo reports a hardware error (register 70)."""
    WATCHDOG_TRIPPED = "watchdog-tripped", 8
    """The servo's own bus watchdog had stopped the motor."""
    SERVO_RESTARTED = "servo-restarted", 9
    """The servo restarted on its own, which resets torque and watchdog."""
    ALARM = "alarm", 10
    """An alarm whose policy is stop."""
    HOST_PAUSED = "host-paused", 11
    """The computer did not run the controller for so long that the servo's own bus watchdog stopped the motor."""
    EMERGENCY_STOP = "emergency-stop", 12
    """The emergency stop is pressed, or cannot be read."""


class AlarmKind(Code):
    """The kind of an alarm. The code is its bit in Estimate.armed_mask and raised_mask."""

    MOTOR_STALL = "motor-stall", 0
    """The cam does not turn as commanded."""
    JAMMED_CELL = "jammed-cell", 1
    """A cell does not extend in its step."""
    NO_PROGRESS = "no-progress", 2
    """The cam turns and the worm does not advance."""
    SLIDING_DOWN = "sliding-down", 3
    """The worm moves down the canal."""
    ENERGY_OVER_BUDGET = "energy-over-budget", 4
    """Cycles cost more than they should."""
    BATTERY_LOW = "battery-low", 5
    """The remaining charge is needed for the way home."""
    LINK_FAULT = "link-fault", 6
    """The servo does not answer, or answers badly."""
    TRACKER_FAULT = "tracker-fault", 7
    """The tracker sends no samples, loses many, or does not see a cell."""
    DEVICE_FAULT = "device-fault", 8
    """The servo reports a hardware error, overheating or low voltage."""
    MODEL_MISMATCH = "model-mismatch", 9
    """The worm makes a displacement that the model does not explain."""
    RECORDING_STOPPED = "recording-stopped", 10
    """The recorder could not go on, or was killed."""
    FRICTION_LOSS = "friction-loss", 11
    """By the motor's current, a cell or all of them have lost friction: a wet canal, a worn pad."""
    INFERRED_JAM = "inferred-jam", 12
    """By the motor's current, a cell does not move in its step."""
    MORE_LOAD = "more-load", 13
    """By the motor's current, the cam's load is larger than it was: a pull on the body, or friction in the gears."""


class HoldReason(Code):
    """Why the controller is in Mode.Holding."""

    NONE = "none", 0
    """It is not holding."""
    COMMAND = "command", 1
    """A command."""
    ALARM = "alarm", 2
    """An alarm with policy hold, or the end of a back-off."""
    LEASE_LAPSED = "lease-lapsed", 3
    """Whoever made the worm crawl is gone, or does not renew its lease."""
    TIME_LIMIT = "time-limit", 4
    """The time for which it was to crawl is over."""


class Culprit(Code):
    """What made a tick end after its deadline."""

    NONE = "none", 0
    """The tick was in time."""
    WAKE = "wake", 1
    """The timer woke the loop late, at its deadline or at the end of its wait for the devices, though a CPU was free
    for it: disabled interrupts, a deep idle state, or a host that does not report stolen time."""
    BUS = "bus", 2
    """The devices were late with their answer."""
    COMPUTE = "compute", 3
    """The tick's own computation took too long."""
    PUBLISH = "publish", 4
    """Publishing, or waking subscribers, took too long."""
    SCHEDULER = "scheduler", 5
    """The loop was ready to run, and the scheduler gave the CPU to another task."""
    PAGE_FAULT = "page-fault", 6
    """The loop had a page fault."""
    STOLEN = "stolen", 7
    """The host took the CPU away from this virtual machine."""


class Severity(Code):
    """How serious an alarm is."""

    WARNING = "warning", 0
    """Worth knowing."""
    CRITICAL = "critical", 1
    """The worm cannot go on like this."""


class CommandKind(Code):
    """A kind of request to the controller."""

    ARM = "arm", 0
    """Torque on."""
    CRAWL = "crawl", 1
    """Turn the cam with the given speed."""
    HOLD = "hold", 2
    """Keep the cam where it is, actively."""
    STOP = "stop", 3
    """Ramp down, then torque off."""
    RESET = "reset", 4
    """Leave the fault state, re-armed from the measured position; with torque on, permit motion despite the alarms
    that stand and do not clear at rest."""
    ACKNOWLEDGE = "acknowledge", 5
    """Note that somebody has seen the alarms of Command.alarm_mask. Permits nothing."""
    RENEW = "renew", 6
    """Go on crawling for Command.limit_s from now on. Never begins a crawl, and changes neither speed nor direction:
    whoever attends to a crawl must not overrule a hold."""
    MARK = "mark", 7
    """Note that the worm is at Command.position_m, for the dead reckoning. Moves and permits nothing."""
    TAKE_OVER = "take-over", 8
    """Note that the sender drives from now on, in place of whoever did. Moves and permits nothing: who drives is the
    relay's to say."""
    NOT_DRIVER = "not-driver", 9
    """Note that a command did not come this far, because another watcher drives. The sender is NAME: COMMAND. Moves
    and permits nothing."""
    NOT_PERMITTED = "not-permitted", 10
    """Note that a command did not come this far, because the certificate of whoever asked over the network does not
    permit it. The sender is NAME: COMMAND, and the name begins with that of the certificate. Moves and permits
    nothing."""
    STALE = "stale", 11
    """Note that a command did not come this far, because it came too late: over the network, or to a relay that stood
    still. The sender is NAME: COMMAND. Moves and permits nothing."""
    BUSY = "busy", 12
    """Note that a command did not come this far, because too many wait for the controller, or too many watchers of a
    laptop command over the network. The sender is NAME: COMMAND. Moves and permits nothing."""


class CommandOutcome(Code):
    """The outcome of a command."""

    ACCEPTED = "accepted", 0
    """Carried out, or under way."""
    WRONG_MODE = "wrong-mode", 1
    """Not possible in the present mode, which is in the reply."""
    FAULT_PERSISTS = "fault-persists", 2
    """The fault's cause is still there."""
    BAD_SPEED = "bad-speed", 3
    """The speed is not a number, or beyond the configured limit."""
    UNKNOWN = "unknown", 4
    """The command's code is unknown to this controller."""
    NO_ESTIMATOR = "no-estimator", 5
    """No estimator is running, and the configuration requires one for crawling."""
    ALARM_STANDS = "alarm-stands", 6
    """An alarm stands whose policy is more than a warning; Reply.alarm_mask has it."""
    NO_LEASE = "no-lease", 7
    """The lease of the supervisor has lapsed, and the command gives no time of its own."""
    BAD_POSITION = "bad-position", 8
    """The position of a mark or its standard error is not a number, or beyond what a canal has."""


class TripPhase(Code):
    """What a trip does."""

    OUTBOUND = "outbound", 0
    """It crawls along the route, away from home."""
    RETURNING = "returning", 1
    """It crawls home."""
    HOLDING = "holding", 2
    """It waits, and does not command motion; the reason says for what."""
    DONE = "done", 3
    """It is over as it should be: the worm is at home, or at the end of a route that goes one way."""
    ABORTED = "aborted", 4
    """It is over before that."""


class TripReason(Code):
    """Why a trip is in its phase."""

    STARTED = "started", 0
    """It was begun."""
    END_OF_ROUTE = "end-of-route", 1
    """The end of the route was reached."""
    HOME = "home", 2
    """The worm is at home."""
    ENERGY = "energy", 3
    """What is left in the battery is needed for the way home."""
    LINK_LOST = "link-lost", 4
    """Nobody was heard for the time after which that counts as a lost link."""
    LINK_BACK = "link-back", 5
    """Somebody is heard again."""
    OPERATOR = "operator", 6
    """An operator told the trip so."""
    HOLD_COMMANDED = "hold-commanded", 7
    """Somebody commanded the worm to hold."""
    STOP_COMMANDED = "stop-commanded", 8
    """Somebody stopped the worm."""
    OTHER_DRIVER = "other-driver", 9
    """Somebody else drives."""
    ALARM = "alarm", 10
    """The controller holds because of an alarm."""
    FAULT = "fault", 11
    """The controller stopped because of a fault."""
    STUCK = "stuck", 12
    """The worm does not get ahead."""
    LAPSED = "lapsed", 13
    """The crawl ended without a command too often: this process is not run in time."""
    SUSPENDED = "suspended", 14
    """This process was suspended."""
    REFUSED = "refused", 15
    """The controller refuses to crawl."""
    CONTROLLER_GONE = "controller-gone", 16
    """The controller is gone."""
    ENDED = "ended", 17
    """This process was told to end."""


class LinkLoss(Code):
    """What a trip does when its link is lost."""

    HOLD = "hold", 0
    """It holds."""
    RETURN = "return", 1
    """It goes home."""
    CONTINUE = "continue", 2
    """It goes on."""


class RecordingState(Code):
    """What a recorder does."""

    RECORDING = "recording", 0
    """It records."""
    ENDED = "ended", 1
    """It has ended in order; its files are complete."""
    STOPPED = "stopped", 2
    """It has stopped because of a RecordingProblem. What was written until then can be read."""


class RecordingProblem(Code):
    """Why a recorder stopped. The code is the value of the alarm recording-stopped."""

    NONE = "none", 0
    """It has not stopped, or has ended in order."""
    DISK_FULL = "disk-full", 1
    """No room: the disk is full, or a quota or a size limit is reached."""
    READ_ONLY = "read-only", 2
    """The file may not be written (any more)."""
    FILE_REMOVED = "file-removed", 3
    """The file was removed while it was written."""
    WRITE_ERROR = "write-error", 4
    """Another write error, such as a disk that failed or was pulled out."""
    TOPICS_UNREADABLE = "topics-unreadable", 5
    """The topics could not be read."""


class InferredStanding(Code):
    """How far self-sensing is."""

    WARMING_UP = "warming-up", 0
    """Too few cycles were fitted: intervals may be too narrow, and no change can be seen yet."""
    FITTED = "fitted", 1
    """The newest cycle was fitted with those before."""
    ODD = "odd", 2
    """The newest cycle is not like those before, and was set aside: the next one shows whether that was an
    accident."""
    CHANGED = "changed", 3
    """The worm is another than it was; masks and loads say in what."""


class _StateMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("phase", ctypes.c_double),
        ("motor_angle_rad", ctypes.c_double),
        ("motor_velocity_rad_s", ctypes.c_double),
        ("goal_velocity_rad_s", ctypes.c_double),
        ("motor_current_a", ctypes.c_double),
        ("motor_duty", ctypes.c_double),
        ("bus_voltage_v", ctypes.c_double),
        ("motor_temperature_c", ctypes.c_double),
        ("motor_time_s", ctypes.c_double),
        ("sample_time_s", ctypes.c_double),
        ("position_m", ctypes.c_double * 16),
        ("sample", ctypes.c_uint64),
        ("samples_missed", ctypes.c_uint64),
        ("link_failures", ctypes.c_uint64),
        ("host_paused_ns", ctypes.c_uint64),
        ("cell_count", ctypes.c_uint32),
        ("valid_mask", ctypes.c_uint32),
        ("sample_is_new", ctypes.c_uint32),
        ("motor_is_new", ctypes.c_uint32),
        ("mode", ctypes.c_uint32),
        ("fault", ctypes.c_uint32),
        ("fault_alarm", ctypes.c_uint32),
        ("hardware_error", ctypes.c_uint32),
        ("hold_reason", ctypes.c_uint32),
        ("acknowledged_mask", ctypes.c_uint32),
        ("acknowledged_by", ctypes.c_uint32),
        ("emergency_stop", ctypes.c_uint32),
        ("pitch_rad", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_state_v4"


@dataclass(frozen=True, slots=True)
class State(Message):
    """One tick of the controller, published every tick."""

    TOPIC: ClassVar[Topic[State]]

    sequence: int
    """Tick number since the controller started; skipped ticks leave a gap in time_ns, never here."""
    time_ns: int
    """When the tick's exchange with the bus ended, ns of CLOCK_MONOTONIC."""
    phase: float
    """Gait cycles done, unwrapped: the cam angle over one turn, zero at the configured home."""
    motor_angle_rad: float
    """Cam angle, rad, unwrapped."""
    motor_velocity_rad_s: float
    """Cam velocity, rad/s."""
    goal_velocity_rad_s: float
    """Velocity commanded in this tick, rad/s."""
    motor_current_a: float
    """Current in the motor winding, A."""
    motor_duty: float
    """Fraction of the bus voltage that the driver applies to the winding, −1 to 1."""
    bus_voltage_v: float
    """Bus voltage, V."""
    motor_temperature_c: float
    """Servo temperature, °C."""
    motor_time_s: float
    """When the servo took these readings, s of its own clock (register 120, realtime tick), unwrapped. It stands
    still while a simulated servo does because its computer pauses."""
    sample_time_s: float
    """When the newest tracker sample was captured, s of the tracker's own clock, unwrapped."""
    position_m: tuple[float, ...]
    """Cell positions along the canal of the newest tracker sample, m; NaN where not seen."""
    sample: int
    """Tracker samples since the controller started, unwrapped; grows by one with each sample that was seen."""
    samples_missed: int
    """Tracker samples missed between two reads, since the controller started."""
    link_failures: int
    """Exchanges since the controller started without a usable answer of the servo. A late answer counts as an
    answer."""
    host_paused_ns: int
    """Time since the controller started in which the computer did not run it though it was due, ns: the sum of all
    pauses of 10 ms and more."""
    cell_count: int
    """How many cells are in use."""
    valid_mask: int
    """Bit i set: cell i was seen in the newest sample."""
    sample_is_new: int
    """1 when the tracker sample is new in this tick, else 0."""
    motor_is_new: int
    """1 when the motor readings came in this tick, 0 when the last ones are repeated."""
    mode: Mode
    """The state of the state machine: Mode."""
    fault: Fault
    """Fault: the latched reason."""
    fault_alarm: AlarmKind | None
    """The AlarmKind behind Fault.Alarm, or None."""
    hardware_error: int
    """Servo register 70, hardware error status, as last read."""
    hold_reason: HoldReason
    """HoldReason."""
    acknowledged_mask: int
    """Bit k set: the alarm with code k stands and was acknowledged."""
    acknowledged_by: int | None
    """User ID of whoever acknowledged an alarm last, or None."""
    emergency_stop: int | None
    """1 while the emergency stop is pressed, else 0; None where there is none."""
    pitch_rad: float
    """Pitch of the body, rad, growing up the canal, by the inertial sensor; NaN where there is none or it is
    silent."""

    @classmethod
    def _from_memory(cls, m: _StateMemory) -> State:
        cells = min(m.cell_count, MAX_CELLS)
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            phase=m.phase,
            motor_angle_rad=m.motor_angle_rad,
            motor_velocity_rad_s=m.motor_velocity_rad_s,
            goal_velocity_rad_s=m.goal_velocity_rad_s,
            motor_current_a=m.motor_current_a,
            motor_duty=m.motor_duty,
            bus_voltage_v=m.bus_voltage_v,
            motor_temperature_c=m.motor_temperature_c,
            motor_time_s=m.motor_time_s,
            sample_time_s=m.sample_time_s,
            position_m=tuple(m.position_m[:cells]),
            sample=m.sample,
            samples_missed=m.samples_missed,
            link_failures=m.link_failures,
            host_paused_ns=m.host_paused_ns,
            cell_count=m.cell_count,
            valid_mask=m.valid_mask,
            sample_is_new=m.sample_is_new,
            motor_is_new=m.motor_is_new,
            mode=Mode.of(m.mode),
            fault=Fault.of(m.fault),
            fault_alarm=None if m.fault_alarm == _NONE else AlarmKind.of(m.fault_alarm),
            hardware_error=m.hardware_error,
            hold_reason=HoldReason.of(m.hold_reason),
            acknowledged_mask=m.acknowledged_mask,
            acknowledged_by=None if m.acknowledged_by == _NONE else m.acknowledged_by,
            emergency_stop=None if m.emergency_stop == _NONE else m.emergency_stop,
            pitch_rad=m.pitch_rad,
        )


State.TOPIC = Topic(
    name="state",
    memory=_StateMemory,
    decode=State._from_memory,
    buffer=1024,
    history=1,
    has_event=True,
    number="sequence",
)


class _TimingMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("deadline_ns", ctypes.c_uint64),
        ("wake_lateness_ns", ctypes.c_uint64),
        ("bus_ns", ctypes.c_uint64),
        ("compute_ns", ctypes.c_uint64),
        ("publish_ns", ctypes.c_uint64),
        ("notify_ns", ctypes.c_uint64),
        ("waited_ns", ctypes.c_uint64),
        ("stolen_ns", ctypes.c_uint64),
        ("overruns", ctypes.c_uint64),
        ("period_ns", ctypes.c_uint64),
        ("host_paused_ns", ctypes.c_uint64),
        ("host_pauses", ctypes.c_uint64),
        ("overrun", ctypes.c_uint32),
        ("culprit", ctypes.c_uint32),
        ("minor_faults", ctypes.c_uint32),
        ("major_faults", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_timing_v3"


@dataclass(frozen=True, slots=True)
class Timing(Message):
    """How long the parts of one tick took, published every tick."""

    TOPIC: ClassVar[Topic[Timing]]

    sequence: int
    """The tick's number, as in State.sequence."""
    deadline_ns: int
    """The absolute time at which the loop was to be woken, ns of CLOCK_MONOTONIC."""
    wake_lateness_ns: int
    """How long after that the loop really ran, ns."""
    bus_ns: int
    """From the first byte handed to the port to the last byte of the answer (or the end of the wait), ns."""
    compute_ns: int
    """The tick's own computation, ns."""
    publish_ns: int
    """Publishing of the *previous* tick's topics, ns (this tick's is not over when this is sent)."""
    notify_ns: int
    """Waking processes that sleep until the next state, ns; close to 0 if there are none."""
    waited_ns: int
    """How long the loop was ready to run and had no CPU, ns. Measured in late ticks only; zero in others."""
    stolen_ns: int
    """How long the host took the CPUs away, ns, in steps of the kernel's clock tick. In late ticks only."""
    overruns: int
    """Ticks skipped since the controller started, because an earlier one ended after their deadline."""
    period_ns: int
    """Time between deadlines, ns: the configured one, or a multiple of it on a computer that cannot hold the
    configured rate."""
    host_paused_ns: int
    """How long the computer did not run the loop before or in this tick though it was due, ns; 0 below 10 ms, which
    is lateness, not a pause."""
    host_pauses: int
    """Such pauses since the controller started, this one included."""
    overrun: int
    """1 when this tick ended after the next deadline."""
    culprit: Culprit
    """Culprit: what made an overrunning tick late."""
    minor_faults: int
    """Page faults in it that memory could serve. In late ticks only."""
    major_faults: int
    """Page faults in it that waited for a disk. In late ticks only."""

    @classmethod
    def _from_memory(cls, m: _TimingMemory) -> Timing:
        return cls(
            sequence=m.sequence,
            deadline_ns=m.deadline_ns,
            wake_lateness_ns=m.wake_lateness_ns,
            bus_ns=m.bus_ns,
            compute_ns=m.compute_ns,
            publish_ns=m.publish_ns,
            notify_ns=m.notify_ns,
            waited_ns=m.waited_ns,
            stolen_ns=m.stolen_ns,
            overruns=m.overruns,
            period_ns=m.period_ns,
            host_paused_ns=m.host_paused_ns,
            host_pauses=m.host_pauses,
            overrun=m.overrun,
            culprit=Culprit.of(m.culprit),
            minor_faults=m.minor_faults,
            major_faults=m.major_faults,
        )


Timing.TOPIC = Topic(
    name="timing",
    memory=_TimingMemory,
    decode=Timing._from_memory,
    buffer=1024,
    history=1,
    has_event=False,
    number="sequence",
)


class _EstimateMemory(Memory):
    _fields_ = [
        ("state_sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("sample", ctypes.c_uint64),
        ("states_lost", ctypes.c_uint64),
        ("phase", ctypes.c_double),
        ("position_m", ctypes.c_double * 16),
        ("contact_m", ctypes.c_double * 16),
        ("deformation_m", ctypes.c_double * 16),
        ("force_n", ctypes.c_double * 16),
        ("forward_slide_m", ctypes.c_double * 16),
        ("backward_slide_m", ctypes.c_double * 16),
        ("power_electrical_w", ctypes.c_double),
        ("energy_electrical_j", ctypes.c_double),
        ("energy_loss_j", ctypes.c_double),
        ("max_deformation_m", ctypes.c_double * 16),
        ("battery_fraction", ctypes.c_double),
        ("cell_count", ctypes.c_uint32),
        ("sliding_mask", ctypes.c_uint32),
        ("armed_mask", ctypes.c_uint32),
        ("raised_mask", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_estimate_v1"


@dataclass(frozen=True, slots=True)
class Estimate(Message):
    """The estimator's result after one tracker sample; repeated as a heartbeat while no sample comes."""

    TOPIC: ClassVar[Topic[Estimate]]

    state_sequence: int
    """Tick number of the state that this estimate is based on."""
    time_ns: int
    """Time of that state, ns of CLOCK_MONOTONIC."""
    sample: int
    """Tracker sample that this estimate is based on, as in State.sample."""
    states_lost: int
    """States that the controller published and the estimator never received."""
    phase: float
    """Gait cycles done, unwrapped."""
    position_m: tuple[float, ...]
    """Filtered cell positions, m; NaN before the first sample."""
    contact_m: tuple[float, ...]
    """Where each tip touches the canal, m, by equations (1) to (3); NaN before the cell's first step."""
    deformation_m: tuple[float, ...]
    """Tip deformation, m, by equation (4)."""
    force_n: tuple[float, ...]
    """Contact force on each cell's tip, k δ, N."""
    forward_slide_m: tuple[float, ...]
    """Distance that each tip slid forward since the estimator started, m."""
    backward_slide_m: tuple[float, ...]
    """Distance that each tip slid backward since the estimator started, m, counted positive."""
    power_electrical_w: float
    """Electrical power into the motor, W."""
    energy_electrical_j: float
    """Electrical energy into the motor since the estimator started, J."""
    energy_loss_j: float
    """Locomotion energy by losses, equation (11), since the estimator started, J."""
    max_deformation_m: tuple[float, ...]
    """Largest tip deformation in use for each cell, m: measured, or identified on the first cycles."""
    battery_fraction: float
    """Estimated charge left in the battery, 0 to 1; NaN when no battery is configured."""
    cell_count: int
    """How many cells are in use."""
    sliding_mask: int
    """Bit i set: tip i slides."""
    armed_mask: int
    """Bit k set: the alarm with code k is armed (calibrated, and in a state in which it can detect something)."""
    raised_mask: int
    """Bit k set: the alarm with code k is raised."""

    @classmethod
    def _from_memory(cls, m: _EstimateMemory) -> Estimate:
        cells = min(m.cell_count, MAX_CELLS)
        return cls(
            state_sequence=m.state_sequence,
            time_ns=m.time_ns,
            sample=m.sample,
            states_lost=m.states_lost,
            phase=m.phase,
            position_m=tuple(m.position_m[:cells]),
            contact_m=tuple(m.contact_m[:cells]),
            deformation_m=tuple(m.deformation_m[:cells]),
            force_n=tuple(m.force_n[:cells]),
            forward_slide_m=tuple(m.forward_slide_m[:cells]),
            backward_slide_m=tuple(m.backward_slide_m[:cells]),
            power_electrical_w=m.power_electrical_w,
            energy_electrical_j=m.energy_electrical_j,
            energy_loss_j=m.energy_loss_j,
            max_deformation_m=tuple(m.max_deformation_m[:cells]),
            battery_fraction=m.battery_fraction,
            cell_count=m.cell_count,
            sliding_mask=m.sliding_mask,
            armed_mask=m.armed_mask,
            raised_mask=m.raised_mask,
        )


Estimate.TOPIC = Topic(
    name="estimate",
    memory=_EstimateMemory,
    decode=Estimate._from_memory,
    buffer=256,
    history=1,
    has_event=False,
    number=None,
)


class _CycleMemory(Memory):
    _fields_ = [
        ("index", ctypes.c_uint64),
        ("end_ns", ctypes.c_uint64),
        ("duration_s", ctypes.c_double),
        ("host_paused_s", ctypes.c_double),
        ("advance_m", ctypes.c_double),
        ("advance_sigma_m", ctypes.c_double),
        ("forward_slide_m", ctypes.c_double * 16),
        ("backward_slide_m", ctypes.c_double * 16),
        ("energy_loss_j", ctypes.c_double),
        ("energy_loss_sigma_j", ctypes.c_double),
        ("energy_actuator_net_j", ctypes.c_double),
        ("energy_actuator_positive_j", ctypes.c_double),
        ("energy_actuator_sigma_j", ctypes.c_double),
        ("energy_electrical_j", ctypes.c_double),
        ("energy_copper_j", ctypes.c_double),
        ("energy_friction_inside_j", ctypes.c_double),
        ("energy_electrical_sigma_j", ctypes.c_double),
        ("cot", ctypes.c_double),
        ("predicted_advance_m", ctypes.c_double),
        ("predicted_energy_loss_j", ctypes.c_double),
        ("predicted_energy_positive_j", ctypes.c_double),
        ("predicted_forward_slide_m", ctypes.c_double * 16),
        ("predicted_backward_slide_m", ctypes.c_double * 16),
        ("samples", ctypes.c_uint32),
        ("cell_count", ctypes.c_uint32),
        ("settled", ctypes.c_uint32),
        ("direction", ctypes.c_int32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_cycle_v2"


@dataclass(frozen=True, slots=True)
class Cycle(Message):
    """One finished gait cycle, with the model's prediction beside the measurement."""

    TOPIC: ClassVar[Topic[Cycle]]

    index: int
    """Number of the cycle since crawling began, from 0."""
    end_ns: int
    """When the cycle ended, ns of CLOCK_MONOTONIC."""
    duration_s: float
    """How long the cycle took, s."""
    host_paused_s: float
    """Part of it in which the computer paused and did not run the controller, s: 0 in an undisturbed cycle. The
    energies leave out time in which a simulated motor stood still."""
    advance_m: float
    """Distance travelled: mean over the cells of the net displacement, m."""
    advance_sigma_m: float
    """Standard error of the advance, m."""
    forward_slide_m: tuple[float, ...]
    """Distance each tip slid forward, m."""
    backward_slide_m: tuple[float, ...]
    """Distance each tip slid backward, m, counted positive."""
    energy_loss_j: float
    """Energy by losses and weight, equation (11), J; NaN when the tracker was silent, like everything measured by
    positions."""
    energy_loss_sigma_j: float
    """Standard error of energy_loss_j, J."""
    energy_actuator_net_j: float
    """Net actuator work, equation (13), J."""
    energy_actuator_positive_j: float
    """Positive part of the actuator work (13), the cost for a drive without energy recovery, J."""
    energy_actuator_sigma_j: float
    """Standard error of the two actuator energies, J."""
    energy_electrical_j: float
    """Electrical energy into the motor, J."""
    energy_copper_j: float
    """Part of it that heated the winding, ∫ I² R dt, J."""
    energy_friction_inside_j: float
    """Part of it lost to friction inside the device: what remains after copper and locomotion, J."""
    energy_electrical_sigma_j: float
    """Standard error of the electrical energies, J."""
    cot: float
    """Cost of transport, positive actuator work over weight and distance; NaN without progress."""
    predicted_advance_m: float
    """Advance that the model predicts, m; NaN where it predicts sliding down."""
    predicted_energy_loss_j: float
    """Energy by (11) that the model predicts, J."""
    predicted_energy_positive_j: float
    """Positive actuator work that the model predicts, J."""
    predicted_forward_slide_m: tuple[float, ...]
    """Forward slide of each tip that the model predicts, m."""
    predicted_backward_slide_m: tuple[float, ...]
    """Backward slide of each tip that the model predicts, m."""
    samples: int
    """Tracker samples in the cycle."""
    cell_count: int
    """How many cells are in use."""
    settled: int
    """1 when every tip's deformation was known from the start of the cycle. 0 in the cycle in which they were found:
    its figures use a guess of the deformations at its start, and its standard errors include that uncertainty."""
    direction: int
    """+1 crawling forward, −1 backward."""

    @classmethod
    def _from_memory(cls, m: _CycleMemory) -> Cycle:
        cells = min(m.cell_count, MAX_CELLS)
        return cls(
            index=m.index,
            end_ns=m.end_ns,
            duration_s=m.duration_s,
            host_paused_s=m.host_paused_s,
            advance_m=m.advance_m,
            advance_sigma_m=m.advance_sigma_m,
            forward_slide_m=tuple(m.forward_slide_m[:cells]),
            backward_slide_m=tuple(m.backward_slide_m[:cells]),
            energy_loss_j=m.energy_loss_j,
            energy_loss_sigma_j=m.energy_loss_sigma_j,
            energy_actuator_net_j=m.energy_actuator_net_j,
            energy_actuator_positive_j=m.energy_actuator_positive_j,
            energy_actuator_sigma_j=m.energy_actuator_sigma_j,
            energy_electrical_j=m.energy_electrical_j,
            energy_copper_j=m.energy_copper_j,
            energy_friction_inside_j=m.energy_friction_inside_j,
            energy_electrical_sigma_j=m.energy_electrical_sigma_j,
            cot=m.cot,
            predicted_advance_m=m.predicted_advance_m,
            predicted_energy_loss_j=m.predicted_energy_loss_j,
            predicted_energy_positive_j=m.predicted_energy_positive_j,
            predicted_forward_slide_m=tuple(m.predicted_forward_slide_m[:cells]),
            predicted_backward_slide_m=tuple(m.predicted_backward_slide_m[:cells]),
            samples=m.samples,
            cell_count=m.cell_count,
            settled=m.settled,
            direction=m.direction,
        )


Cycle.TOPIC = Topic(
    name="cycle",
    memory=_CycleMemory,
    decode=Cycle._from_memory,
    buffer=64,
    history=16,
    has_event=False,
    number="index",
)


class _AlarmMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("since_ns", ctypes.c_uint64),
        ("value", ctypes.c_double),
        ("threshold", ctypes.c_double),
        ("phase", ctypes.c_double),
        ("kind", ctypes.c_uint32),
        ("severity", ctypes.c_uint32),
        ("raised", ctypes.c_uint32),
        ("cell", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_alarm_v1"


@dataclass(frozen=True, slots=True)
class Alarm(Message):
    """One change of one alarm: raised or cleared."""

    TOPIC: ClassVar[Topic[Alarm]]

    sequence: int
    """Number of this change since the estimator started."""
    time_ns: int
    """When it was raised or cleared, ns of CLOCK_MONOTONIC."""
    since_ns: int
    """When its condition began, as estimated, ns of CLOCK_MONOTONIC."""
    value: float
    """The monitored quantity at the change, in the unit of the threshold."""
    threshold: float
    """The threshold that it passed."""
    phase: float
    """Gait phase at the change, cycles; for a model mismatch, the last one at which the gait passed the place where
    it shows."""
    kind: AlarmKind
    """The kind of alarm: AlarmKind."""
    severity: Severity
    """How serious it is: Severity."""
    raised: int
    """1 raised, 0 cleared."""
    cell: int | None
    """The cell concerned, from 0, or None where it is not a single cell."""

    @classmethod
    def _from_memory(cls, m: _AlarmMemory) -> Alarm:
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            since_ns=m.since_ns,
            value=m.value,
            threshold=m.threshold,
            phase=m.phase,
            kind=AlarmKind.of(m.kind),
            severity=Severity.of(m.severity),
            raised=m.raised,
            cell=None if m.cell == _NONE else m.cell,
        )


Alarm.TOPIC = Topic(
    name="alarm",
    memory=_AlarmMemory,
    decode=Alarm._from_memory,
    buffer=64,
    history=32,
    has_event=True,
    number="sequence",
)


class _RangeMemory(Memory):
    _fields_ = [
        ("index", ctypes.c_uint64),
        ("end_ns", ctypes.c_uint64),
        ("charge_share", ctypes.c_double),
        ("charge_sigma_share", ctypes.c_double),
        ("energy_left_j", ctypes.c_double),
        ("energy_left_low_j", ctypes.c_double),
        ("energy_left_high_j", ctypes.c_double),
        ("energy_per_cycle_j", ctypes.c_double),
        ("energy_per_cycle_sigma_j", ctypes.c_double),
        ("advance_per_cycle_m", ctypes.c_double),
        ("advance_per_cycle_sigma_m", ctypes.c_double),
        ("cycles", ctypes.c_double),
        ("cycles_low", ctypes.c_double),
        ("cycles_high", ctypes.c_double),
        ("range_m", ctypes.c_double),
        ("range_low_m", ctypes.c_double),
        ("range_high_m", ctypes.c_double),
        ("time_s", ctypes.c_double),
        ("time_low_s", ctypes.c_double),
        ("time_high_s", ctypes.c_double),
        ("gauge_share", ctypes.c_double),
        ("cycles_used", ctypes.c_uint32),
        ("direction", ctypes.c_int32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_range_v1"


@dataclass(frozen=True, slots=True)
class Range(Message):
    """How far and how long the battery lasts if the worm crawls on as in its last cycles: after each gait cycle,
    where a battery is configured. The low and high values bound a 90 % interval. What is kept in reserve does not
    count."""

    TOPIC: ClassVar[Topic[Range]]

    index: int
    """Number of the gait cycle that it follows, as in the topic cycle."""
    end_ns: int
    """When that cycle ended, ns of CLOCK_MONOTONIC."""
    charge_share: float
    """Share of the battery's energy that is left, 0 to 1."""
    charge_sigma_share: float
    """Its standard error."""
    energy_left_j: float
    """Energy left above the reserve and above the charge at which the voltage gets too low, J."""
    energy_left_low_j: float
    """Lower bound of it, J."""
    energy_left_high_j: float
    """Upper bound of it, J."""
    energy_per_cycle_j: float
    """Energy that a gait cycle takes from the battery: motor, hotel power, loss in the battery, J."""
    energy_per_cycle_sigma_j: float
    """Its standard error, J."""
    advance_per_cycle_m: float
    """Distance that a gait cycle advances, m."""
    advance_per_cycle_sigma_m: float
    """Its standard error, m."""
    cycles: float
    """Gait cycles left."""
    cycles_low: float
    """Lower bound of them."""
    cycles_high: float
    """Upper bound of them."""
    range_m: float
    """Distance left, m; 0 where the worm does not advance."""
    range_low_m: float
    """Lower bound of it, m."""
    range_high_m: float
    """Upper bound of it, m."""
    time_s: float
    """Time left, s."""
    time_low_s: float
    """Lower bound of it, s."""
    time_high_s: float
    """Upper bound of it, s."""
    gauge_share: float
    """The gauge's reading that was taken with this cycle, 0 to 1; NaN without one."""
    cycles_used: int
    """Gait cycles since the worm began to crawl as it does now, that this rests on besides the model."""
    direction: int
    """+1 crawling forward, −1 backward."""

    @classmethod
    def _from_memory(cls, m: _RangeMemory) -> Range:
        return cls(
            index=m.index,
            end_ns=m.end_ns,
            charge_share=m.charge_share,
            charge_sigma_share=m.charge_sigma_share,
            energy_left_j=m.energy_left_j,
            energy_left_low_j=m.energy_left_low_j,
            energy_left_high_j=m.energy_left_high_j,
            energy_per_cycle_j=m.energy_per_cycle_j,
            energy_per_cycle_sigma_j=m.energy_per_cycle_sigma_j,
            advance_per_cycle_m=m.advance_per_cycle_m,
            advance_per_cycle_sigma_m=m.advance_per_cycle_sigma_m,
            cycles=m.cycles,
            cycles_low=m.cycles_low,
            cycles_high=m.cycles_high,
            range_m=m.range_m,
            range_low_m=m.range_low_m,
            range_high_m=m.range_high_m,
            time_s=m.time_s,
            time_low_s=m.time_low_s,
            time_high_s=m.time_high_s,
            gauge_share=m.gauge_share,
            cycles_used=m.cycles_used,
            direction=m.direction,
        )


Range.TOPIC = Topic(
    name="range",
    memory=_RangeMemory,
    decode=Range._from_memory,
    buffer=64,
    history=1,
    has_event=False,
    number="index",
)


class _CommandRecordMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("state_sequence", ctypes.c_uint64),
        ("cycles_per_s", ctypes.c_double),
        ("limit_s", ctypes.c_double),
        ("kind", ctypes.c_uint32),
        ("outcome", ctypes.c_uint32),
        ("alarm_mask", ctypes.c_uint32),
        ("answer_alarm_mask", ctypes.c_uint32),
        ("mode", ctypes.c_uint32),
        ("fault", ctypes.c_uint32),
        ("supervised", ctypes.c_uint32),
        ("user", ctypes.c_uint32),
        ("sender", ctypes.c_uint8 * 32),
        ("phase", ctypes.c_double),
        ("position_m", ctypes.c_double),
        ("position_sigma_m", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_command_record_v2"


@dataclass(frozen=True, slots=True)
class CommandRecord(Message):
    """One command that the controller took or refused, and its answer."""

    TOPIC: ClassVar[Topic[CommandRecord]]

    sequence: int
    """Number of this command since the controller started."""
    time_ns: int
    """When the tick that processed it had its readings, ns of CLOCK_MONOTONIC."""
    state_sequence: int
    """The tick that processed it, as in the topic state."""
    cycles_per_s: float
    """Commanded gait cycles per second, negative for backward; 0 means the configured gait."""
    limit_s: float
    """How long the worm was to crawl at most, s; 0 leaves it to the controller."""
    kind: CommandKind
    """The kind of command: CommandKind."""
    outcome: CommandOutcome
    """What became of it: CommandOutcome."""
    alarm_mask: int
    """Bit k set: the command concerned the alarm with code k."""
    answer_alarm_mask: int
    """Bit k set: the alarm with code k stood in its way, or was acknowledged by it."""
    mode: Mode
    """The mode after it: Mode."""
    fault: Fault
    """The fault after it: Fault."""
    supervised: int
    """1 while whoever started the controller watched over the worm: a crawl without a time of its own then lasts as
    long as that."""
    user: int
    """User ID of the sender, as the sender gave it."""
    sender: str
    """Who sent it, as the sender says: a program, or the watcher whose command it passed on."""
    phase: float
    """Gait phase of the tick that processed it, cycles."""
    position_m: float
    """For a mark, where the mean of the cells was said to be along the canal, m; NaN for other commands."""
    position_sigma_m: float
    """For a mark, the standard error of that, m; NaN for other commands."""

    @classmethod
    def _from_memory(cls, m: _CommandRecordMemory) -> CommandRecord:
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            state_sequence=m.state_sequence,
            cycles_per_s=m.cycles_per_s,
            limit_s=m.limit_s,
            kind=CommandKind.of(m.kind),
            outcome=CommandOutcome.of(m.outcome),
            alarm_mask=m.alarm_mask,
            answer_alarm_mask=m.answer_alarm_mask,
            mode=Mode.of(m.mode),
            fault=Fault.of(m.fault),
            supervised=m.supervised,
            user=m.user,
            sender=text(m.sender),
            phase=m.phase,
            position_m=m.position_m,
            position_sigma_m=m.position_sigma_m,
        )


CommandRecord.TOPIC = Topic(
    name="command",
    memory=_CommandRecordMemory,
    decode=CommandRecord._from_memory,
    buffer=256,
    history=32,
    has_event=False,
    number="sequence",
)


class _TripStatusMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("started_ns", ctypes.c_uint64),
        ("since_ns", ctypes.c_uint64),
        ("position_m", ctypes.c_double),
        ("position_sigma_m", ctypes.c_double),
        ("length_m", ctypes.c_double),
        ("turn_m", ctypes.c_double),
        ("leg_left_m", ctypes.c_double),
        ("cycles_per_s", ctypes.c_double),
        ("advance_per_cycle_m", ctypes.c_double),
        ("advance_per_cycle_sigma_m", ctypes.c_double),
        ("advance_scatter_m", ctypes.c_double),
        ("energy_left_j", ctypes.c_double),
        ("energy_left_low_j", ctypes.c_double),
        ("energy_left_high_j", ctypes.c_double),
        ("energy_home_j", ctypes.c_double),
        ("energy_home_low_j", ctypes.c_double),
        ("energy_home_high_j", ctypes.c_double),
        ("home_s", ctypes.c_double),
        ("home_low_s", ctypes.c_double),
        ("home_high_s", ctypes.c_double),
        ("left_s", ctypes.c_double),
        ("left_low_s", ctypes.c_double),
        ("left_high_s", ctypes.c_double),
        ("link_age_s", ctypes.c_double),
        ("link_timeout_s", ctypes.c_double),
        ("point_m", ctypes.c_double * 16),
        ("point_s", ctypes.c_double * 16),
        ("point_sigma_m", ctypes.c_double * 16),
        ("phase", ctypes.c_uint32),
        ("reason", ctypes.c_uint32),
        ("heading", ctypes.c_uint32),
        ("alarm", ctypes.c_uint32),
        ("link_loss", ctypes.c_uint32),
        ("link_is_lost", ctypes.c_uint32),
        ("return_home", ctypes.c_uint32),
        ("leg", ctypes.c_uint32),
        ("leg_count", ctypes.c_uint32),
        ("point_count", ctypes.c_uint32),
        ("cycles", ctypes.c_uint32),
        ("needs_operator", ctypes.c_uint32),
        ("by", ctypes.c_uint8 * 32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_trip_v1"


@dataclass(frozen=True, slots=True)
class TripStatus(Message):
    """How a trip stands: twice a second, and at every change. Low and high values bound a 90 % interval. Energies and
    what follows from them are not known without a battery. The lists are where the worm is expected if all goes on as
    planned: the way ahead, and the way home. They hold up to 16 points."""

    TOPIC: ClassVar[Topic[TripStatus]]

    sequence: int
    """Number of this message since the trip began."""
    time_ns: int
    """When it was made, ns of CLOCK_MONOTONIC."""
    started_ns: int
    """When the trip began, ns of CLOCK_MONOTONIC."""
    since_ns: int
    """When it came into its phase, for its reason, ns of CLOCK_MONOTONIC."""
    position_m: float
    """Distance from home along the route, m."""
    position_sigma_m: float
    """Its standard error, m."""
    length_m: float
    """Length of the route, m."""
    turn_m: float
    """Furthest distance from home that the trip is expected to reach, m; where a trip returns already, the furthest
    it has reached."""
    leg_left_m: float
    """Length of the present leg that is still ahead, in the direction of the trip, m."""
    cycles_per_s: float
    """Speed of the cam that the trip commands, gait cycles per second, negative for backward; 0 while it commands
    none."""
    advance_per_cycle_m: float
    """Distance that a gait cycle is expected to advance on the present leg, m."""
    advance_per_cycle_sigma_m: float
    """Its standard error, m."""
    advance_scatter_m: float
    """Standard deviation of the advance from cycle to cycle, m."""
    energy_left_j: float
    """Energy left in the battery above the reserve of this trip, J."""
    energy_left_low_j: float
    """Lower bound of it, J."""
    energy_left_high_j: float
    """Upper bound of it, J."""
    energy_home_j: float
    """Energy that the way home needs from here, J."""
    energy_home_low_j: float
    """Lower bound of it, J."""
    energy_home_high_j: float
    """Upper bound of it, J."""
    home_s: float
    """Time that the way home takes from here, s."""
    home_low_s: float
    """Lower bound of it, s."""
    home_high_s: float
    """Upper bound of it, s."""
    left_s: float
    """Time until the trip is over, s; not known while it waits."""
    left_low_s: float
    """Lower bound of it, s."""
    left_high_s: float
    """Upper bound of it, s."""
    link_age_s: float
    """How long ago somebody was last heard, s."""
    link_timeout_s: float
    """Silence after which the link counts as lost, s."""
    point_m: tuple[float, ...]
    """Distances from home of the points ahead, m."""
    point_s: tuple[float, ...]
    """Times from now at which the worm is expected there, s."""
    point_sigma_m: tuple[float, ...]
    """Standard errors of the place at these times, m."""
    phase: TripPhase
    """What it does: TripPhase."""
    reason: TripReason
    """Why: TripReason."""
    heading: TripPhase
    """What it goes on with when it no longer waits, outbound or returning: TripPhase."""
    alarm: AlarmKind | None
    """Alarm behind the reason alarm or fault: AlarmKind, or None."""
    link_loss: LinkLoss
    """What it does when the link is lost: LinkLoss."""
    link_is_lost: int
    """1 while the link counts as lost, else 0."""
    return_home: int
    """1 where the worm comes home at the end of the route, 0 where the trip ends there."""
    leg: int
    """Number of the present leg, from 1."""
    leg_count: int
    """Legs of the route."""
    point_count: int
    """Points in the lists."""
    cycles: int
    """Gait cycles that were measured on this trip."""
    needs_operator: int
    """1 where only an operator can make it go on: wormd trip resume."""
    by: str
    """Who commanded what it waits for, or how it goes on: a program, or a watcher; empty where nobody did."""

    @classmethod
    def _from_memory(cls, m: _TripStatusMemory) -> TripStatus:
        cells = min(m.point_count, MAX_CELLS)
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            started_ns=m.started_ns,
            since_ns=m.since_ns,
            position_m=m.position_m,
            position_sigma_m=m.position_sigma_m,
            length_m=m.length_m,
            turn_m=m.turn_m,
            leg_left_m=m.leg_left_m,
            cycles_per_s=m.cycles_per_s,
            advance_per_cycle_m=m.advance_per_cycle_m,
            advance_per_cycle_sigma_m=m.advance_per_cycle_sigma_m,
            advance_scatter_m=m.advance_scatter_m,
            energy_left_j=m.energy_left_j,
            energy_left_low_j=m.energy_left_low_j,
            energy_left_high_j=m.energy_left_high_j,
            energy_home_j=m.energy_home_j,
            energy_home_low_j=m.energy_home_low_j,
            energy_home_high_j=m.energy_home_high_j,
            home_s=m.home_s,
            home_low_s=m.home_low_s,
            home_high_s=m.home_high_s,
            left_s=m.left_s,
            left_low_s=m.left_low_s,
            left_high_s=m.left_high_s,
            link_age_s=m.link_age_s,
            link_timeout_s=m.link_timeout_s,
            point_m=tuple(m.point_m[:cells]),
            point_s=tuple(m.point_s[:cells]),
            point_sigma_m=tuple(m.point_sigma_m[:cells]),
            phase=TripPhase.of(m.phase),
            reason=TripReason.of(m.reason),
            heading=TripPhase.of(m.heading),
            alarm=None if m.alarm == _NONE else AlarmKind.of(m.alarm),
            link_loss=LinkLoss.of(m.link_loss),
            link_is_lost=m.link_is_lost,
            return_home=m.return_home,
            leg=m.leg,
            leg_count=m.leg_count,
            point_count=m.point_count,
            cycles=m.cycles,
            needs_operator=m.needs_operator,
            by=text(m.by),
        )


TripStatus.TOPIC = Topic(
    name="trip",
    memory=_TripStatusMemory,
    decode=TripStatus._from_memory,
    buffer=32,
    history=1,
    has_event=False,
    number="sequence",
)


class _RecordingStatusMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("bytes", ctypes.c_uint64),
        ("messages", ctypes.c_uint64),
        ("messages_lost", ctypes.c_uint64),
        ("files", ctypes.c_uint64),
        ("state", ctypes.c_uint32),
        ("problem", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_recording_v1"


@dataclass(frozen=True, slots=True)
class RecordingStatus(Message):
    """The state of the worm's recorder: once a second and at every change."""

    TOPIC: ClassVar[Topic[RecordingStatus]]

    sequence: int
    """Number of this message since the recorder started."""
    time_ns: int
    """When it was sent, ns of CLOCK_MONOTONIC."""
    bytes: int
    """Bytes written, in all files of this recording together."""
    messages: int
    """Messages handed to the log."""
    messages_lost: int
    """Messages that were published and did not arrive at the recorder."""
    files: int
    """Files begun."""
    state: RecordingState
    """RecordingState."""
    problem: RecordingProblem
    """RecordingProblem: why it stopped."""

    @classmethod
    def _from_memory(cls, m: _RecordingStatusMemory) -> RecordingStatus:
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            bytes=m.bytes,
            messages=m.messages,
            messages_lost=m.messages_lost,
            files=m.files,
            state=RecordingState.of(m.state),
            problem=RecordingProblem.of(m.problem),
        )


RecordingStatus.TOPIC = Topic(
    name="recording",
    memory=_RecordingStatusMemory,
    decode=RecordingStatus._from_memory,
    buffer=16,
    history=1,
    has_event=False,
    number="sequence",
)


class _InferredMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("end_ns", ctypes.c_uint64),
        ("state_sequence", ctypes.c_uint64),
        ("end_phase", ctypes.c_double),
        ("cycles", ctypes.c_double),
        ("friction_n", ctypes.c_double * 16),
        ("friction_sigma_n", ctypes.c_double * 16),
        ("stiffness_n_per_m", ctypes.c_double * 16),
        ("stiffness_sigma_n_per_m", ctypes.c_double * 16),
        ("forward_slide_m", ctypes.c_double * 16),
        ("backward_slide_m", ctypes.c_double * 16),
        ("pull_n", ctypes.c_double),
        ("pull_sigma_n", ctypes.c_double),
        ("slope_rad", ctypes.c_double),
        ("slope_sigma_rad", ctypes.c_double),
        ("other_pull_n", ctypes.c_double),
        ("other_probability", ctypes.c_double),
        ("advance_m", ctypes.c_double),
        ("advance_sigma_m", ctypes.c_double),
        ("energy_loss_j", ctypes.c_double),
        ("energy_loss_sigma_j", ctypes.c_double),
        ("energy_actuator_net_j", ctypes.c_double),
        ("energy_actuator_net_sigma_j", ctypes.c_double),
        ("energy_electrical_j", ctypes.c_double),
        ("energy_electrical_sigma_j", ctypes.c_double),
        ("residual_n_m", ctypes.c_double),
        ("position_m", ctypes.c_double),
        ("position_sigma_m", ctypes.c_double),
        ("phase", ctypes.c_double),
        ("friction_loss_share", ctypes.c_double),
        ("load_rise_n", ctypes.c_double),
        ("change_friction_sigma", ctypes.c_double),
        ("change_pull_sigma_n", ctypes.c_double),
        ("friction_lost_mask", ctypes.c_uint32),
        ("jammed_mask", ctypes.c_uint32),
        ("more_load", ctypes.c_uint32),
        ("friction_armed_mask", ctypes.c_uint32),
        ("jam_armed_mask", ctypes.c_uint32),
        ("load_armed", ctypes.c_uint32),
        ("marks", ctypes.c_uint32),
        ("tracker_marks", ctypes.c_uint32),
        ("standing", ctypes.c_uint32),
        ("cell_count", ctypes.c_uint32),
        ("slope_is_measured", ctypes.c_uint32),
        ("contradicting_marks", ctypes.c_uint32),
        ("slide_sigma_m", ctypes.c_double),
        ("friction_loss_sigma", ctypes.c_double),
        ("load_rise_sigma_n", ctypes.c_double),
        ("mark_off_m", ctypes.c_double),
        ("mark_off_sigma_m", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_inferred_v3"


@dataclass(frozen=True, slots=True)
class Inferred(Message):
    """What the motor's current alone says of the worm, with standard errors: after each gait cycle crawled forward,
    as soon as it is fitted, at the end of every other cycle, when only the place is new, and after a mark. Positions
    play no part in it, but for those that correct the dead reckoning."""

    TOPIC: ClassVar[Topic[Inferred]]

    sequence: int
    """Number of this message since the estimator started."""
    time_ns: int
    """When it was made, ns of CLOCK_MONOTONIC."""
    end_ns: int
    """When the newest cycle ended, ns of CLOCK_MONOTONIC; 0 before the first."""
    state_sequence: int
    """The tick with which it was made, as in the topic state."""
    end_phase: float
    """Gait phase at the end of the newest cycle, cycles."""
    cycles: float
    """Cycles that were fitted together, forgotten ones counted less."""
    friction_n: tuple[float, ...]
    """Friction force k·δmax of each cell, N."""
    friction_sigma_n: tuple[float, ...]
    """Standard error of friction_n, N."""
    stiffness_n_per_m: tuple[float, ...]
    """Stiffness of each cell, N/m."""
    stiffness_sigma_n_per_m: tuple[float, ...]
    """Standard error of stiffness_n_per_m, N/m."""
    forward_slide_m: tuple[float, ...]
    """Distance that each tip slides forward in a cycle, m, by the model."""
    backward_slide_m: tuple[float, ...]
    """Distance that each tip slides backward in a cycle, m, counted positive."""
    pull_n: float
    """Pull on the body down the canal, N: weight and constant drag together."""
    pull_sigma_n: float
    """Standard error of pull_n, N."""
    slope_rad: float
    """The slope, rad: as the inertial sensor measured it, or if all the pull is the weight of the stated mass."""
    slope_sigma_rad: float
    """Standard error of slope_rad, rad."""
    other_pull_n: float
    """Another pull that explains the current as well, N; NaN where there is none."""
    other_probability: float
    """Probability of that other answer; NaN where there is none."""
    advance_m: float
    """Advance of a cycle, m, by the model."""
    advance_sigma_m: float
    """Standard error of advance_m, m."""
    energy_loss_j: float
    """Energy of a cycle by losses and weight, equation (11), J."""
    energy_loss_sigma_j: float
    """Standard error of energy_loss_j, J."""
    energy_actuator_net_j: float
    """Net actuator work of a cycle, equation (13), J."""
    energy_actuator_net_sigma_j: float
    """Standard error of energy_actuator_net_j, J."""
    energy_electrical_j: float
    """Electrical energy of the newest cycle, J."""
    energy_electrical_sigma_j: float
    """Standard error of energy_electrical_j, J."""
    residual_n_m: float
    """Root mean square of what the model leaves unexplained in the mean torque, N m at the cam."""
    position_m: float
    """Distance along the canal by dead reckoning, m, at phase: from where the worm began, or as the tracker or the
    last mark counts."""
    position_sigma_m: float
    """Standard error of position_m, m: it grows until a tracker sample or a mark comes."""
    phase: float
    """Gait phase with which this was made, cycles."""
    friction_loss_share: float
    """Largest share of a cell's friction that was lost; NaN where none was."""
    load_rise_n: float
    """How much more the cam's load is than before, as a pull on the body, N; NaN while nothing has changed."""
    change_friction_sigma: float
    """Standard error of one cycle's ln friction, the worst cell's; NaN while no change could be seen."""
    change_pull_sigma_n: float
    """Standard error of one cycle's pull, N; NaN while no change could be seen."""
    friction_lost_mask: int
    """Bit i: friction of cell i was lost."""
    jammed_mask: int
    """Bit i: cell i does not move."""
    more_load: int
    """1 when the load is larger than it was: a pull on the body or friction in the gears."""
    friction_armed_mask: int
    """Bit i: a loss of 30 % of cell i's friction would be seen."""
    jam_armed_mask: int
    """Bit i: a jam of cell i would be seen."""
    load_armed: int
    """1 while more load would be seen."""
    marks: int
    """Marks that corrected the distance."""
    tracker_marks: int
    """Cycles at whose end a tracker sample corrected the distance."""
    standing: InferredStanding
    """InferredStanding."""
    cell_count: int
    """How many cells are in use."""
    slope_is_measured: int
    """1 when the inertial sensor measured the slope, 0 when it follows from the pull."""
    contradicting_marks: int
    """Marks that contradict the dead reckoning and each other: further off than three standard errors."""
    slide_sigma_m: float
    """Standard error of forward_slide_m and backward_slide_m, m: the largest of all cells'."""
    friction_loss_sigma: float
    """Standard error of friction_loss_share; NaN where none was lost."""
    load_rise_sigma_n: float
    """Standard error of load_rise_n, N; NaN while nothing has changed."""
    mark_off_m: float
    """How far the last mark was ahead of the dead reckoning, m; NaN before the first."""
    mark_off_sigma_m: float
    """Standard error of that by mark and dead reckoning together, m; NaN before the first."""

    @classmethod
    def _from_memory(cls, m: _InferredMemory) -> Inferred:
        cells = min(m.cell_count, MAX_CELLS)
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            end_ns=m.end_ns,
            state_sequence=m.state_sequence,
            end_phase=m.end_phase,
            cycles=m.cycles,
            friction_n=tuple(m.friction_n[:cells]),
            friction_sigma_n=tuple(m.friction_sigma_n[:cells]),
            stiffness_n_per_m=tuple(m.stiffness_n_per_m[:cells]),
            stiffness_sigma_n_per_m=tuple(m.stiffness_sigma_n_per_m[:cells]),
            forward_slide_m=tuple(m.forward_slide_m[:cells]),
            backward_slide_m=tuple(m.backward_slide_m[:cells]),
            pull_n=m.pull_n,
            pull_sigma_n=m.pull_sigma_n,
            slope_rad=m.slope_rad,
            slope_sigma_rad=m.slope_sigma_rad,
            other_pull_n=m.other_pull_n,
            other_probability=m.other_probability,
            advance_m=m.advance_m,
            advance_sigma_m=m.advance_sigma_m,
            energy_loss_j=m.energy_loss_j,
            energy_loss_sigma_j=m.energy_loss_sigma_j,
            energy_actuator_net_j=m.energy_actuator_net_j,
            energy_actuator_net_sigma_j=m.energy_actuator_net_sigma_j,
            energy_electrical_j=m.energy_electrical_j,
            energy_electrical_sigma_j=m.energy_electrical_sigma_j,
            residual_n_m=m.residual_n_m,
            position_m=m.position_m,
            position_sigma_m=m.position_sigma_m,
            phase=m.phase,
            friction_loss_share=m.friction_loss_share,
            load_rise_n=m.load_rise_n,
            change_friction_sigma=m.change_friction_sigma,
            change_pull_sigma_n=m.change_pull_sigma_n,
            friction_lost_mask=m.friction_lost_mask,
            jammed_mask=m.jammed_mask,
            more_load=m.more_load,
            friction_armed_mask=m.friction_armed_mask,
            jam_armed_mask=m.jam_armed_mask,
            load_armed=m.load_armed,
            marks=m.marks,
            tracker_marks=m.tracker_marks,
            standing=InferredStanding.of(m.standing),
            cell_count=m.cell_count,
            slope_is_measured=m.slope_is_measured,
            contradicting_marks=m.contradicting_marks,
            slide_sigma_m=m.slide_sigma_m,
            friction_loss_sigma=m.friction_loss_sigma,
            load_rise_sigma_n=m.load_rise_sigma_n,
            mark_off_m=m.mark_off_m,
            mark_off_sigma_m=m.mark_off_sigma_m,
        )


Inferred.TOPIC = Topic(
    name="inferred",
    memory=_InferredMemory,
    decode=Inferred._from_memory,
    buffer=64,
    history=1,
    has_event=False,
    number="sequence",
)


class _BlackBoxStatusMemory(Memory):
    _fields_ = [
        ("sequence", ctypes.c_uint64),
        ("time_ns", ctypes.c_uint64),
        ("memory_bytes", ctypes.c_uint64),
        ("written_bytes", ctypes.c_uint64),
        ("boxes", ctypes.c_uint64),
        ("messages", ctypes.c_uint64),
        ("messages_lost", ctypes.c_uint64),
        ("state", ctypes.c_uint32),
        ("problem", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "wormd_black_box_v1"


@dataclass(frozen=True, slots=True)
class BlackBoxStatus(Message):
    """The state of the worm's black box: once a second and at every change."""

    TOPIC: ClassVar[Topic[BlackBoxStatus]]

    sequence: int
    """Number of this message since the black box started."""
    time_ns: int
    """When it was sent, ns of CLOCK_MONOTONIC."""
    memory_bytes: int
    """Compressed messages in memory, bytes."""
    written_bytes: int
    """Written since it started, bytes."""
    boxes: int
    """Boxes begun since it started."""
    messages: int
    """Messages handed to it."""
    messages_lost: int
    """Messages that were published and did not arrive at it."""
    state: RecordingState
    """RecordingState: stopped while it cannot write. It goes on in memory, and tries again."""
    problem: RecordingProblem
    """RecordingProblem: why it cannot write."""

    @classmethod
    def _from_memory(cls, m: _BlackBoxStatusMemory) -> BlackBoxStatus:
        return cls(
            sequence=m.sequence,
            time_ns=m.time_ns,
            memory_bytes=m.memory_bytes,
            written_bytes=m.written_bytes,
            boxes=m.boxes,
            messages=m.messages,
            messages_lost=m.messages_lost,
            state=RecordingState.of(m.state),
            problem=RecordingProblem.of(m.problem),
        )


BlackBoxStatus.TOPIC = Topic(
    name="black_box",
    memory=_BlackBoxStatusMemory,
    decode=BlackBoxStatus._from_memory,
    buffer=16,
    history=1,
    has_event=False,
    number="sequence",
)
