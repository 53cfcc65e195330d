/* The messages on the topics of a worm, for C11 and C++17.
 *
 * Made by `wormd topics --c-header`, version 0.1.0; do not edit. docs/topics.md explains topics and rules.
 *
 * A service is worm/NAME/TOPIC; iceoryx2 compares the name, size and alignment of its type. Numbers that are not known
 * are NaN, and what may be missing is WORMD_NONE. Arrays over cells have WORMD_MAX_CELLS places, of which the first
 * cell_count are in use; cell 1 of the paper is index 0. Times are nanoseconds of CLOCK_MONOTONIC. */
#ifndef WORMD_H
#define WORMD_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#define WORMD_VERSION "0.1.0"
#define WORMD_MAX_CELLS 16
#define WORMD_NONE UINT32_MAX

#define WORMD_STATE_TOPIC "state"
#define WORMD_STATE_TYPE "wormd_state_v4"
#define WORMD_STATE_BUFFER 1024
#define WORMD_STATE_HISTORY 1

#define WORMD_TIMING_TOPIC "timing"
#define WORMD_TIMING_TYPE "wormd_timing_v3"
#define WORMD_TIMING_BUFFER 1024
#define WORMD_TIMING_HISTORY 1

#define WORMD_ESTIMATE_TOPIC "estimate"
#define WORMD_ESTIMATE_TYPE "wormd_estimate_v1"
#define WORMD_ESTIMATE_BUFFER 256
#define WORMD_ESTIMATE_HISTORY 1

#define WORMD_CYCLE_TOPIC "cycle"
#define WORMD_CYCLE_TYPE "wormd_cycle_v2"
#define WORMD_CYCLE_BUFFER 64
#define WORMD_CYCLE_HISTORY 16

#define WORMD_ALARM_TOPIC "alarm"
#define WORMD_ALARM_TYPE "wormd_alarm_v1"
#define WORMD_ALARM_BUFFER 64
#define WORMD_ALARM_HISTORY 32

#define WORMD_RANGE_TOPIC "range"
#define WORMD_RANGE_TYPE "wormd_range_v1"
#define WORMD_RANGE_BUFFER 64
#define WORMD_RANGE_HISTORY 1

#define WORMD_COMMAND_TOPIC "command"
#define WORMD_COMMAND_TYPE "wormd_command_record_v2"
#define WORMD_COMMAND_BUFFER 256
#define WORMD_COMMAND_HISTORY 32

#define WORMD_TRIP_TOPIC "trip"
#define WORMD_TRIP_TYPE "wormd_trip_v1"
#define WORMD_TRIP_BUFFER 32
#define WORMD_TRIP_HISTORY 1

#define WORMD_RECORDING_TOPIC "recording"
#define WORMD_RECORDING_TYPE "wormd_recording_v1"
#define WORMD_RECORDING_BUFFER 16
#define WORMD_RECORDING_HISTORY 1

#define WORMD_INFERRED_TOPIC "inferred"
#define WORMD_INFERRED_TYPE "wormd_inferred_v3"
#define WORMD_INFERRED_BUFFER 64
#define WORMD_INFERRED_HISTORY 1

#define WORMD_BLACK_BOX_TOPIC "black_box"
#define WORMD_BLACK_BOX_TYPE "wormd_black_box_v1"
#define WORMD_BLACK_BOX_BUFFER 16
#define WORMD_BLACK_BOX_HISTORY 1

/* Request and response on the service worm/NAME/command. */
#define WORMD_COMMAND_REQUEST_TYPE "wormd_command_v4"
#define WORMD_COMMAND_RESPONSE_TYPE "wormd_reply_v2"

/* The state of the controller's state machine. */
enum wormd_mode {
  /* No torque; the cam can be turned by hand. */
  WORMD_MODE_DISARMED = 0,
  /* Torque on, goal velocity zero, ready to crawl. */
  WORMD_MODE_ARMED = 1,
  /* The cam turns at the commanded speed. */
  WORMD_MODE_CRAWLING = 2,
  /* The cam is actively kept at the angle it had when the hold began. */
  WORMD_MODE_HOLDING = 3,
  /* The speed ramps down; torque goes off when the cam stands still. */
  WORMD_MODE_STOPPING = 4,
  /* A safety rule stopped the worm; the reason is latched until a reset. */
  WORMD_MODE_FAULT = 5,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_mode_name(uint32_t code) {
  switch (code) {
    case WORMD_MODE_DISARMED: return "disarmed";
    case WORMD_MODE_ARMED: return "armed";
    case WORMD_MODE_CRAWLING: return "crawling";
    case WORMD_MODE_HOLDING: return "holding";
    case WORMD_MODE_STOPPING: return "stopping";
    case WORMD_MODE_FAULT: return "fault";
    default: return "unknown";
  }
}

/* Why the controller is in Mode::Fault: the first reason, latched. */
enum wormd_fault {
  /* No fault. */
  WORMD_FAULT_NONE = 0,
  /* The servo did not answer for longer than the configured time. */
  WORMD_FAULT_LINK_LOST = 1,
  /* The tracker gave no new sample for longer than the configured time. */
  WORMD_FAULT_TRACKER_STALE = 2,
  /* The estimator was silent for longer than the configured time. */
  WORMD_FAULT_ESTIMATOR_SILENT = 3,
  /* The motor current stayed above its limit. */
  WORMD_FAULT_OVER_CURRENT = 4,
  /* The servo is hotter than its limit. */
  WORMD_FAULT_OVER_TEMPERATURE = 5,
  /* The bus voltage fell below its limit. */
  WORMD_FAULT_UNDER_VOLTAGE = 6,
  /* The servo reports a hardware error (register 70). */
  WORMD_FAULT_SERVO_HARDWARE = 7,
  /* The servo's own bus watchdog had stopped the motor. */
  WORMD_FAULT_WATCHDOG_TRIPPED = 8,
  /* The servo restarted on its own, which resets torque and watchdog. */
  WORMD_FAULT_SERVO_RESTARTED = 9,
  /* An alarm whose policy is stop. */
  WORMD_FAULT_ALARM = 10,
  /* The computer did not run the controller for so long that the servo's own bus watchdog stopped the motor. */
  WORMD_FAULT_HOST_PAUSED = 11,
  /* The emergency stop is pressed, or cannot be read. */
  WORMD_FAULT_EMERGENCY_STOP = 12,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_fault_name(uint32_t code) {
  switch (code) {
    case WORMD_FAULT_NONE: return "none";
    case WORMD_FAULT_LINK_LOST: return "link-lost";
    case WORMD_FAULT_TRACKER_STALE: return "tracker-stale";
    case WORMD_FAULT_ESTIMATOR_SILENT: return "estimator-silent";
    case WORMD_FAULT_OVER_CURRENT: return "over-current";
    case WORMD_FAULT_OVER_TEMPERATURE: return "over-temperature";
    case WORMD_FAULT_UNDER_VOLTAGE: return "under-voltage";
    case WORMD_FAULT_SERVO_HARDWARE: return "servo-hardware";
    case WORMD_FAULT_WATCHDOG_TRIPPED: return "watchdog-tripped";
    case WORMD_FAULT_SERVO_RESTARTED: return "servo-restarted";
    case WORMD_FAULT_ALARM: return "alarm";
    case WORMD_FAULT_HOST_PAUSED: return "host-paused";
    case WORMD_FAULT_EMERGENCY_STOP: return "emergency-stop";
    default: return "unknown";
  }
}

/* The kind of an alarm. The code is its bit in Estimate::armed_mask and raised_mask. */
enum wormd_alarm_kind {
  /* The cam does not turn as commanded. */
  WORMD_ALARM_KIND_MOTOR_STALL = 0,
  /* A cell does not extend in its step. */
  WORMD_ALARM_KIND_JAMMED_CELL = 1,
  /* The cam turns and the worm does not advance. */
  WORMD_ALARM_KIND_NO_PROGRESS = 2,
  /* The worm moves down the canal. */
  WORMD_ALARM_KIND_SLIDING_DOWN = 3,
  /* Cycles cost more than they should. */
  WORMD_ALARM_KIND_ENERGY_OVER_BUDGET = 4,
  /* The remaining charge is needed for the way home. */
  WORMD_ALARM_KIND_BATTERY_LOW = 5,
  /* The servo does not answer, or answers badly. */
  WORMD_ALARM_KIND_LINK_FAULT = 6,
  /* The tracker sends no samples, loses many, or does not see a cell. */
  WORMD_ALARM_KIND_TRACKER_FAULT = 7,
  /* The servo reports a hardware error, overheating or low voltage. */
  WORMD_ALARM_KIND_DEVICE_FAULT = 8,
  /* The worm makes a displacement that the model does not explain. */
  WORMD_ALARM_KIND_MODEL_MISMATCH = 9,
  /* The recorder could not go on, or was killed. */
  WORMD_ALARM_KIND_RECORDING_STOPPED = 10,
  /* By the motor's current, a cell or all of them have lost friction: a wet canal, a worn pad. */
  WORMD_ALARM_KIND_FRICTION_LOSS = 11,
  /* By the motor's current, a cell does not move in its step. */
  WORMD_ALARM_KIND_INFERRED_JAM = 12,
  /* By the motor's current, the cam's load is larger than it was: a pull on the body, or friction in the
     gears. */
  WORMD_ALARM_KIND_MORE_LOAD = 13,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_alarm_kind_name(uint32_t code) {
  switch (code) {
    case WORMD_ALARM_KIND_MOTOR_STALL: return "motor-stall";
    case WORMD_ALARM_KIND_JAMMED_CELL: return "jammed-cell";
    case WORMD_ALARM_KIND_NO_PROGRESS: return "no-progress";
    case WORMD_ALARM_KIND_SLIDING_DOWN: return "sliding-down";
    case WORMD_ALARM_KIND_ENERGY_OVER_BUDGET: return "energy-over-budget";
    case WORMD_ALARM_KIND_BATTERY_LOW: return "battery-low";
    case WORMD_ALARM_KIND_LINK_FAULT: return "link-fault";
    case WORMD_ALARM_KIND_TRACKER_FAULT: return "tracker-fault";
    case WORMD_ALARM_KIND_DEVICE_FAULT: return "device-fault";
    case WORMD_ALARM_KIND_MODEL_MISMATCH: return "model-mismatch";
    case WORMD_ALARM_KIND_RECORDING_STOPPED: return "recording-stopped";
    case WORMD_ALARM_KIND_FRICTION_LOSS: return "friction-loss";
    case WORMD_ALARM_KIND_INFERRED_JAM: return "inferred-jam";
    case WORMD_ALARM_KIND_MORE_LOAD: return "more-load";
    default: return "unknown";
  }
}

/* Why the controller is in Mode::Holding. */
enum wormd_hold_reason {
  /* It is not holding. */
  WORMD_HOLD_REASON_NONE = 0,
  /* A command. */
  WORMD_HOLD_REASON_COMMAND = 1,
  /* An alarm with policy hold, or the end of a back-off. */
  WORMD_HOLD_REASON_ALARM = 2,
  /* Whoever made the worm crawl is gone, or does not renew its lease. */
  WORMD_HOLD_REASON_LEASE_LAPSED = 3,
  /* The time for which it was to crawl is over. */
  WORMD_HOLD_REASON_TIME_LIMIT = 4,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_hold_reason_name(uint32_t code) {
  switch (code) {
    case WORMD_HOLD_REASON_NONE: return "none";
    case WORMD_HOLD_REASON_COMMAND: return "command";
    case WORMD_HOLD_REASON_ALARM: return "alarm";
    case WORMD_HOLD_REASON_LEASE_LAPSED: return "lease-lapsed";
    case WORMD_HOLD_REASON_TIME_LIMIT: return "time-limit";
    default: return "unknown";
  }
}

/* What made a tick end after its deadline. */
enum wormd_culprit {
  /* The tick was in time. */
  WORMD_CULPRIT_NONE = 0,
  /* The timer woke the loop late, at its deadline or at the end of its wait for the devices, though a CPU was
     free for it: disabled interrupts, a deep idle state, or a host that does not report stolen time. */
  WORMD_CULPRIT_WAKE = 1,
  /* The devices were late with their answer. */
  WORMD_CULPRIT_BUS = 2,
  /* The tick's own computation took too long. */
  WORMD_CULPRIT_COMPUTE = 3,
  /* Publishing, or waking subscribers, took too long. */
  WORMD_CULPRIT_PUBLISH = 4,
  /* The loop was ready to run, and the scheduler gave the CPU to another task. */
  WORMD_CULPRIT_SCHEDULER = 5,
  /* The loop had a page fault. */
  WORMD_CULPRIT_PAGE_FAULT = 6,
  /* The host took the CPU away from this virtual machine. */
  WORMD_CULPRIT_STOLEN = 7,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_culprit_name(uint32_t code) {
  switch (code) {
    case WORMD_CULPRIT_NONE: return "none";
    case WORMD_CULPRIT_WAKE: return "wake";
    case WORMD_CULPRIT_BUS: return "bus";
    case WORMD_CULPRIT_COMPUTE: return "compute";
    case WORMD_CULPRIT_PUBLISH: return "publish";
    case WORMD_CULPRIT_SCHEDULER: return "scheduler";
    case WORMD_CULPRIT_PAGE_FAULT: return "page-fault";
    case WORMD_CULPRIT_STOLEN: return "stolen";
    default: return "unknown";
  }
}

/* How serious an alarm is. */
enum wormd_severity {
  /* Worth knowing. */
  WORMD_SEVERITY_WARNING = 0,
  /* The worm cannot go on like this. */
  WORMD_SEVERITY_CRITICAL = 1,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_severity_name(uint32_t code) {
  switch (code) {
    case WORMD_SEVERITY_WARNING: return "warning";
    case WORMD_SEVERITY_CRITICAL: return "critical";
    default: return "unknown";
  }
}

/* A kind of request to the controller. */
enum wormd_command_kind {
  /* Torque on. */
  WORMD_COMMAND_KIND_ARM = 0,
  /* Turn the cam with the given speed. */
  WORMD_COMMAND_KIND_CRAWL = 1,
  /* Keep the cam where it is, actively. */
  WORMD_COMMAND_KIND_HOLD = 2,
  /* Ramp down, then torque off. */
  WORMD_COMMAND_KIND_STOP = 3,
  /* Leave the fault state, re-armed from the measured position; with torque on, permit motion despite the
     alarms that stand and do not clear at rest. */
  WORMD_COMMAND_KIND_RESET = 4,
  /* Note that somebody has seen the alarms of Command::alarm_mask. Permits nothing. */
  WORMD_COMMAND_KIND_ACKNOWLEDGE = 5,
  /* Go on crawling for Command::limit_s from now on. Never begins a crawl, and changes neither speed nor
     direction: whoever attends to a crawl must not overrule a hold. */
  WORMD_COMMAND_KIND_RENEW = 6,
  /* Note that the worm is at Command::position_m, for the dead reckoning. Moves and permits nothing. */
  WORMD_COMMAND_KIND_MARK = 7,
  /* Note that the sender drives from now on, in place of whoever did. Moves and permits nothing: who drives
     is the relay's to say. */
  WORMD_COMMAND_KIND_TAKE_OVER = 8,
  /* Note that a command did not come this far, because another watcher drives. The sender is NAME: COMMAND.
     Moves and permits nothing. */
  WORMD_COMMAND_KIND_NOT_DRIVER = 9,
  /* Note that a command did not come this far, because the certificate of whoever asked over the network does
     not permit it. The sender is NAME: COMMAND, and the name begins with that of the certificate. Moves and
     permits nothing. */
  WORMD_COMMAND_KIND_NOT_PERMITTED = 10,
  /* Note that a command did not come this far, because it came too late: over the network, or to a relay that
     stood still. The sender is NAME: COMMAND. Moves and permits nothing. */
  WORMD_COMMAND_KIND_STALE = 11,
  /* Note that a command did not come this far, because too many wait for the controller, or too many watchers
     of a laptop command over the network. The sender is NAME: COMMAND. Moves and permits nothing. */
  WORMD_COMMAND_KIND_BUSY = 12,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_command_kind_name(uint32_t code) {
  switch (code) {
    case WORMD_COMMAND_KIND_ARM: return "arm";
    case WORMD_COMMAND_KIND_CRAWL: return "crawl";
    case WORMD_COMMAND_KIND_HOLD: return "hold";
    case WORMD_COMMAND_KIND_STOP: return "stop";
    case WORMD_COMMAND_KIND_RESET: return "reset";
    case WORMD_COMMAND_KIND_ACKNOWLEDGE: return "acknowledge";
    case WORMD_COMMAND_KIND_RENEW: return "renew";
    case WORMD_COMMAND_KIND_MARK: return "mark";
    case WORMD_COMMAND_KIND_TAKE_OVER: return "take-over";
    case WORMD_COMMAND_KIND_NOT_DRIVER: return "not-driver";
    case WORMD_COMMAND_KIND_NOT_PERMITTED: return "not-permitted";
    case WORMD_COMMAND_KIND_STALE: return "stale";
    case WORMD_COMMAND_KIND_BUSY: return "busy";
    default: return "unknown";
  }
}

/* The outcome of a command. */
enum wormd_command_outcome {
  /* Carried out, or under way. */
  WORMD_COMMAND_OUTCOME_ACCEPTED = 0,
  /* Not possible in the present mode, which is in the reply. */
  WORMD_COMMAND_OUTCOME_WRONG_MODE = 1,
  /* The fault's cause is still there. */
  WORMD_COMMAND_OUTCOME_FAULT_PERSISTS = 2,
  /* The speed is not a number, or beyond the configured limit. */
  WORMD_COMMAND_OUTCOME_BAD_SPEED = 3,
  /* The command's code is unknown to this controller. */
  WORMD_COMMAND_OUTCOME_UNKNOWN = 4,
  /* No estimator is running, and the configuration requires one for crawling. */
  WORMD_COMMAND_OUTCOME_NO_ESTIMATOR = 5,
  /* An alarm stands whose policy is more than a warning; Reply::alarm_mask has it. */
  WORMD_COMMAND_OUTCOME_ALARM_STANDS = 6,
  /* The lease of the supervisor has lapsed, and the command gives no time of its own. */
  WORMD_COMMAND_OUTCOME_NO_LEASE = 7,
  /* The position of a mark or its standard error is not a number, or beyond what a canal has. */
  WORMD_COMMAND_OUTCOME_BAD_POSITION = 8,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_command_outcome_name(uint32_t code) {
  switch (code) {
    case WORMD_COMMAND_OUTCOME_ACCEPTED: return "accepted";
    case WORMD_COMMAND_OUTCOME_WRONG_MODE: return "wrong-mode";
    case WORMD_COMMAND_OUTCOME_FAULT_PERSISTS: return "fault-persists";
    case WORMD_COMMAND_OUTCOME_BAD_SPEED: return "bad-speed";
    case WORMD_COMMAND_OUTCOME_UNKNOWN: return "unknown";
    case WORMD_COMMAND_OUTCOME_NO_ESTIMATOR: return "no-estimator";
    case WORMD_COMMAND_OUTCOME_ALARM_STANDS: return "alarm-stands";
    case WORMD_COMMAND_OUTCOME_NO_LEASE: return "no-lease";
    case WORMD_COMMAND_OUTCOME_BAD_POSITION: return "bad-position";
    default: return "unknown";
  }
}

/* What a trip does. */
enum wormd_trip_phase {
  /* It crawls along the route, away from home. */
  WORMD_TRIP_PHASE_OUTBOUND = 0,
  /* It crawls home. */
  WORMD_TRIP_PHASE_RETURNING = 1,
  /* It waits, and does not command motion; the reason says for what. */
  WORMD_TRIP_PHASE_HOLDING = 2,
  /* It is over as it should be: the worm is at home, or at the end of a route that goes one way. */
  WORMD_TRIP_PHASE_DONE = 3,
  /* It is over before that. */
  WORMD_TRIP_PHASE_ABORTED = 4,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_trip_phase_name(uint32_t code) {
  switch (code) {
    case WORMD_TRIP_PHASE_OUTBOUND: return "outbound";
    case WORMD_TRIP_PHASE_RETURNING: return "returning";
    case WORMD_TRIP_PHASE_HOLDING: return "holding";
    case WORMD_TRIP_PHASE_DONE: return "done";
    case WORMD_TRIP_PHASE_ABORTED: return "aborted";
    default: return "unknown";
  }
}

/* Why a trip is in its phase. */
enum wormd_trip_reason {
  /* It was begun. */
  WORMD_TRIP_REASON_STARTED = 0,
  /* The end of the route was reached. */
  WORMD_TRIP_REASON_END_OF_ROUTE = 1,
  /* The worm is at home. */
  WORMD_TRIP_REASON_HOME = 2,
  /* What is left in the battery is needed for the way home. */
  WORMD_TRIP_REASON_ENERGY = 3,
  /* Nobody was heard for the time after which that counts as a lost link. */
  WORMD_TRIP_REASON_LINK_LOST = 4,
  /* Somebody is heard again. */
  WORMD_TRIP_REASON_LINK_BACK = 5,
  /* An operator told the trip so. */
  WORMD_TRIP_REASON_OPERATOR = 6,
  /* Somebody commanded the worm to hold. */
  WORMD_TRIP_REASON_HOLD_COMMANDED = 7,
  /* Somebody stopped the worm. */
  WORMD_TRIP_REASON_STOP_COMMANDED = 8,
  /* Somebody else drives. */
  WORMD_TRIP_REASON_OTHER_DRIVER = 9,
  /* The controller holds because of an alarm. */
  WORMD_TRIP_REASON_ALARM = 10,
  /* The controller stopped because of a fault. */
  WORMD_TRIP_REASON_FAULT = 11,
  /* The worm does not get ahead. */
  WORMD_TRIP_REASON_STUCK = 12,
  /* The crawl ended without a command too often: this process is not run in time. */
  WORMD_TRIP_REASON_LAPSED = 13,
  /* This process was suspended. */
  WORMD_TRIP_REASON_SUSPENDED = 14,
  /* The controller refuses to crawl. */
  WORMD_TRIP_REASON_REFUSED = 15,
  /* The controller is gone. */
  WORMD_TRIP_REASON_CONTROLLER_GONE = 16,
  /* This process was told to end. */
  WORMD_TRIP_REASON_ENDED = 17,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_trip_reason_name(uint32_t code) {
  switch (code) {
    case WORMD_TRIP_REASON_STARTED: return "started";
    case WORMD_TRIP_REASON_END_OF_ROUTE: return "end-of-route";
    case WORMD_TRIP_REASON_HOME: return "home";
    case WORMD_TRIP_REASON_ENERGY: return "energy";
    case WORMD_TRIP_REASON_LINK_LOST: return "link-lost";
    case WORMD_TRIP_REASON_LINK_BACK: return "link-back";
    case WORMD_TRIP_REASON_OPERATOR: return "operator";
    case WORMD_TRIP_REASON_HOLD_COMMANDED: return "hold-commanded";
    case WORMD_TRIP_REASON_STOP_COMMANDED: return "stop-commanded";
    case WORMD_TRIP_REASON_OTHER_DRIVER: return "other-driver";
    case WORMD_TRIP_REASON_ALARM: return "alarm";
    case WORMD_TRIP_REASON_FAULT: return "fault";
    case WORMD_TRIP_REASON_STUCK: return "stuck";
    case WORMD_TRIP_REASON_LAPSED: return "lapsed";
    case WORMD_TRIP_REASON_SUSPENDED: return "suspended";
    case WORMD_TRIP_REASON_REFUSED: return "refused";
    case WORMD_TRIP_REASON_CONTROLLER_GONE: return "controller-gone";
    case WORMD_TRIP_REASON_ENDED: return "ended";
    default: return "unknown";
  }
}

/* What a trip does when its link is lost. */
enum wormd_link_loss {
  /* It holds. */
  WORMD_LINK_LOSS_HOLD = 0,
  /* It goes home. */
  WORMD_LINK_LOSS_RETURN = 1,
  /* It goes on. */
  WORMD_LINK_LOSS_CONTINUE = 2,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_link_loss_name(uint32_t code) {
  switch (code) {
    case WORMD_LINK_LOSS_HOLD: return "hold";
    case WORMD_LINK_LOSS_RETURN: return "return";
    case WORMD_LINK_LOSS_CONTINUE: return "continue";
    default: return "unknown";
  }
}

/* What a recorder does. */
enum wormd_recording_state {
  /* It records. */
  WORMD_RECORDING_STATE_RECORDING = 0,
  /* It has ended in order; its files are complete. */
  WORMD_RECORDING_STATE_ENDED = 1,
  /* It has stopped because of a RecordingProblem. What was written until then can be read. */
  WORMD_RECORDING_STATE_STOPPED = 2,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_recording_state_name(uint32_t code) {
  switch (code) {
    case WORMD_RECORDING_STATE_RECORDING: return "recording";
    case WORMD_RECORDING_STATE_ENDED: return "ended";
    case WORMD_RECORDING_STATE_STOPPED: return "stopped";
    default: return "unknown";
  }
}

/* Why a recorder stopped. The code is the value of the alarm recording-stopped. */
enum wormd_recording_problem {
  /* It has not stopped, or has ended in order. */
  WORMD_RECORDING_PROBLEM_NONE = 0,
  /* No room: the disk is full, or a quota or a size limit is reached. */
  WORMD_RECORDING_PROBLEM_DISK_FULL = 1,
  /* The file may not be written (any more). */
  WORMD_RECORDING_PROBLEM_READ_ONLY = 2,
  /* The file was removed while it was written. */
  WORMD_RECORDING_PROBLEM_FILE_REMOVED = 3,
  /* Another write error, such as a disk that failed or was pulled out. */
  WORMD_RECORDING_PROBLEM_WRITE_ERROR = 4,
  /* The topics could not be read. */
  WORMD_RECORDING_PROBLEM_TOPICS_UNREADABLE = 5,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_recording_problem_name(uint32_t code) {
  switch (code) {
    case WORMD_RECORDING_PROBLEM_NONE: return "none";
    case WORMD_RECORDING_PROBLEM_DISK_FULL: return "disk-full";
    case WORMD_RECORDING_PROBLEM_READ_ONLY: return "read-only";
    case WORMD_RECORDING_PROBLEM_FILE_REMOVED: return "file-removed";
    case WORMD_RECORDING_PROBLEM_WRITE_ERROR: return "write-error";
    case WORMD_RECORDING_PROBLEM_TOPICS_UNREADABLE: return "topics-unreadable";
    default: return "unknown";
  }
}

/* How far self-sensing is. */
enum wormd_inferred_standing {
  /* Too few cycles were fitted: intervals may be too narrow, and no change can be seen yet. */
  WORMD_INFERRED_STANDING_WARMING_UP = 0,
  /* The newest cycle was fitted with those before. */
  WORMD_INFERRED_STANDING_FITTED = 1,
  /* The newest cycle is not like those before, and was set aside: the next one shows whether that was an
     accident. */
  WORMD_INFERRED_STANDING_ODD = 2,
  /* The worm is another than it was; masks and loads say in what. */
  WORMD_INFERRED_STANDING_CHANGED = 3,
};

/* The name, as in logs; "unknown" for a code of a newer version. */
static inline const char *wormd_inferred_standing_name(uint32_t code) {
  switch (code) {
    case WORMD_INFERRED_STANDING_WARMING_UP: return "warming-up";
    case WORMD_INFERRED_STANDING_FITTED: return "fitted";
    case WORMD_INFERRED_STANDING_ODD: return "odd";
    case WORMD_INFERRED_STANDING_CHANGED: return "changed";
    default: return "unknown";
  }
}

/* One tick of the controller, published every tick. */
typedef struct wormd_state {
  /* Tick number since the controller started; skipped ticks leave a gap in time_ns, never here. */
  uint64_t sequence;
  /* When the tick's exchange with the bus ended, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* Gait cycles done, unwrapped: the cam angle over one turn, zero at the configured home. */
  double phase;
  /* Cam angle, rad, unwrapped. */
  double motor_angle_rad;
  /* Cam velocity, rad/s. */
  double motor_velocity_rad_s;
  /* Velocity commanded in this tick, rad/s. */
  double goal_velocity_rad_s;
  /* Current in the motor winding, A. */
  double motor_current_a;
  /* Fraction of the bus voltage that the driver applies to the winding, −1 to 1. */
  double motor_duty;
  /* Bus voltage, V. */
  double bus_voltage_v;
  /* Servo temperature, °C. */
  double motor_temperature_c;
  /* When the servo took these readings, s of its own clock (register 120, realtime tick), unwrapped. It
     stands still while a simulated servo does because its computer pauses. */
  double motor_time_s;
  /* When the newest tracker sample was captured, s of the tracker's own clock, unwrapped. */
  double sample_time_s;
  /* Cell positions along the canal of the newest tracker sample, m; NaN where not seen. */
  double position_m[WORMD_MAX_CELLS];
  /* Tracker samples since the controller started, unwrapped; grows by one with each sample that was seen. */
  uint64_t sample;
  /* Tracker samples missed between two reads, since the controller started. */
  uint64_t samples_missed;
  /* Exchanges since the controller started without a usable answer of the servo. A late answer counts as an
     answer. */
  uint64_t link_failures;
  /* Time since the controller started in which the computer did not run it though it was due, ns: the sum of
     all pauses of 10 ms and more. */
  uint64_t host_paused_ns;
  /* How many cells are in use. */
  uint32_t cell_count;
  /* Bit i set: cell i was seen in the newest sample. */
  uint32_t valid_mask;
  /* 1 when the tracker sample is new in this tick, else 0. */
  uint32_t sample_is_new;
  /* 1 when the motor readings came in this tick, 0 when the last ones are repeated. */
  uint32_t motor_is_new;
  /* The state of the state machine: Mode. A code of enum wormd_mode. */
  uint32_t mode;
  /* Fault: the latched reason. A code of enum wormd_fault. */
  uint32_t fault;
  /* The AlarmKind behind Fault::Alarm, or WORMD_NONE. A code of enum wormd_alarm_kind. */
  uint32_t fault_alarm;
  /* Servo register 70, hardware error status, as last read. */
  uint32_t hardware_error;
  /* HoldReason. A code of enum wormd_hold_reason. */
  uint32_t hold_reason;
  /* Bit k set: the alarm with code k stands and was acknowledged. */
  uint32_t acknowledged_mask;
  /* User ID of whoever acknowledged an alarm last, or WORMD_NONE. */
  uint32_t acknowledged_by;
  /* 1 while the emergency stop is pressed, else 0; WORMD_NONE where there is none. */
  uint32_t emergency_stop;
  /* Pitch of the body, rad, growing up the canal, by the inertial sensor; NaN where there is none or it is
     silent. */
  double pitch_rad;
} wormd_state;

static_assert(sizeof(wormd_state) == 312, "wormd_state has another size here than in wormd");
static_assert(offsetof(wormd_state, sequence) == 0, "wormd_state.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_state, time_ns) == 8, "wormd_state.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_state, phase) == 16, "wormd_state.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_angle_rad) == 24, "wormd_state.motor_angle_rad lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_velocity_rad_s) == 32, "wormd_state.motor_velocity_rad_s lies elsewhere in wormd");
static_assert(offsetof(wormd_state, goal_velocity_rad_s) == 40, "wormd_state.goal_velocity_rad_s lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_current_a) == 48, "wormd_state.motor_current_a lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_duty) == 56, "wormd_state.motor_duty lies elsewhere in wormd");
static_assert(offsetof(wormd_state, bus_voltage_v) == 64, "wormd_state.bus_voltage_v lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_temperature_c) == 72, "wormd_state.motor_temperature_c lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_time_s) == 80, "wormd_state.motor_time_s lies elsewhere in wormd");
static_assert(offsetof(wormd_state, sample_time_s) == 88, "wormd_state.sample_time_s lies elsewhere in wormd");
static_assert(offsetof(wormd_state, position_m) == 96, "wormd_state.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_state, sample) == 224, "wormd_state.sample lies elsewhere in wormd");
static_assert(offsetof(wormd_state, samples_missed) == 232, "wormd_state.samples_missed lies elsewhere in wormd");
static_assert(offsetof(wormd_state, link_failures) == 240, "wormd_state.link_failures lies elsewhere in wormd");
static_assert(offsetof(wormd_state, host_paused_ns) == 248, "wormd_state.host_paused_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_state, cell_count) == 256, "wormd_state.cell_count lies elsewhere in wormd");
static_assert(offsetof(wormd_state, valid_mask) == 260, "wormd_state.valid_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_state, sample_is_new) == 264, "wormd_state.sample_is_new lies elsewhere in wormd");
static_assert(offsetof(wormd_state, motor_is_new) == 268, "wormd_state.motor_is_new lies elsewhere in wormd");
static_assert(offsetof(wormd_state, mode) == 272, "wormd_state.mode lies elsewhere in wormd");
static_assert(offsetof(wormd_state, fault) == 276, "wormd_state.fault lies elsewhere in wormd");
static_assert(offsetof(wormd_state, fault_alarm) == 280, "wormd_state.fault_alarm lies elsewhere in wormd");
static_assert(offsetof(wormd_state, hardware_error) == 284, "wormd_state.hardware_error lies elsewhere in wormd");
static_assert(offsetof(wormd_state, hold_reason) == 288, "wormd_state.hold_reason lies elsewhere in wormd");
static_assert(offsetof(wormd_state, acknowledged_mask) == 292, "wormd_state.acknowledged_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_state, acknowledged_by) == 296, "wormd_state.acknowledged_by lies elsewhere in wormd");
static_assert(offsetof(wormd_state, emergency_stop) == 300, "wormd_state.emergency_stop lies elsewhere in wormd");
static_assert(offsetof(wormd_state, pitch_rad) == 304, "wormd_state.pitch_rad lies elsewhere in wormd");

/* How long the parts of one tick took, published every tick. */
typedef struct wormd_timing {
  /* The tick's number, as in State::sequence. */
  uint64_t sequence;
  /* The absolute time at which the loop was to be woken, ns of CLOCK_MONOTONIC. */
  uint64_t deadline_ns;
  /* How long after that the loop really ran, ns. */
  uint64_t wake_lateness_ns;
  /* From the first byte handed to the port to the last byte of the answer (or the end of the wait), ns. */
  uint64_t bus_ns;
  /* The tick's own computation, ns. */
  uint64_t compute_ns;
  /* Publishing of the *previous* tick's topics, ns (this tick's is not over when this is sent). */
  uint64_t publish_ns;
  /* Waking processes that sleep until the next state, ns; close to 0 if there are none. */
  uint64_t notify_ns;
  /* How long the loop was ready to run and had no CPU, ns. Measured in late ticks only; zero in others. */
  uint64_t waited_ns;
  /* How long the host took the CPUs away, ns, in steps of the kernel's clock tick. In late ticks only. */
  uint64_t stolen_ns;
  /* Ticks skipped since the controller started, because an earlier one ended after their deadline. */
  uint64_t overruns;
  /* Time between deadlines, ns: the configured one, or a multiple of it on a computer that cannot hold the
     configured rate. */
  uint64_t period_ns;
  /* How long the computer did not run the loop before or in this tick though it was due, ns; 0 below 10 ms,
     which is lateness, not a pause. */
  uint64_t host_paused_ns;
  /* Such pauses since the controller started, this one included. */
  uint64_t host_pauses;
  /* 1 when this tick ended after the next deadline. */
  uint32_t overrun;
  /* Culprit: what made an overrunning tick late. A code of enum wormd_culprit. */
  uint32_t culprit;
  /* Page faults in it that memory could serve. In late ticks only. */
  uint32_t minor_faults;
  /* Page faults in it that waited for a disk. In late ticks only. */
  uint32_t major_faults;
} wormd_timing;

static_assert(sizeof(wormd_timing) == 120, "wormd_timing has another size here than in wormd");
static_assert(offsetof(wormd_timing, sequence) == 0, "wormd_timing.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, deadline_ns) == 8, "wormd_timing.deadline_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, wake_lateness_ns) == 16, "wormd_timing.wake_lateness_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, bus_ns) == 24, "wormd_timing.bus_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, compute_ns) == 32, "wormd_timing.compute_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, publish_ns) == 40, "wormd_timing.publish_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, notify_ns) == 48, "wormd_timing.notify_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, waited_ns) == 56, "wormd_timing.waited_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, stolen_ns) == 64, "wormd_timing.stolen_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, overruns) == 72, "wormd_timing.overruns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, period_ns) == 80, "wormd_timing.period_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, host_paused_ns) == 88, "wormd_timing.host_paused_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, host_pauses) == 96, "wormd_timing.host_pauses lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, overrun) == 104, "wormd_timing.overrun lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, culprit) == 108, "wormd_timing.culprit lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, minor_faults) == 112, "wormd_timing.minor_faults lies elsewhere in wormd");
static_assert(offsetof(wormd_timing, major_faults) == 116, "wormd_timing.major_faults lies elsewhere in wormd");

/* The estimator's result after one tracker sample; repeated as a heartbeat while no sample comes. */
typedef struct wormd_estimate {
  /* Tick number of the state that this estimate is based on. */
  uint64_t state_sequence;
  /* Time of that state, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* Tracker sample that this estimate is based on, as in State::sample. */
  uint64_t sample;
  /* States that the controller published and the estimator never received. */
  uint64_t states_lost;
  /* Gait cycles done, unwrapped. */
  double phase;
  /* Filtered cell positions, m; NaN before the first sample. */
  double position_m[WORMD_MAX_CELLS];
  /* Where each tip touches the canal, m, by equations (1) to (3); NaN before the cell's first step. */
  double contact_m[WORMD_MAX_CELLS];
  /* Tip deformation, m, by equation (4). */
  double deformation_m[WORMD_MAX_CELLS];
  /* Contact force on each cell's tip, k δ, N. */
  double force_n[WORMD_MAX_CELLS];
  /* Distance that each tip slid forward since the estimator started, m. */
  double forward_slide_m[WORMD_MAX_CELLS];
  /* Distance that each tip slid backward since the estimator started, m, counted positive. */
  double backward_slide_m[WORMD_MAX_CELLS];
  /* Electrical power into the motor, W. */
  double power_electrical_w;
  /* Electrical energy into the motor since the estimator started, J. */
  double energy_electrical_j;
  /* Locomotion energy by losses, equation (11), since the estimator started, J. */
  double energy_loss_j;
  /* Largest tip deformation in use for each cell, m: measured, or identified on the first cycles. */
  double max_deformation_m[WORMD_MAX_CELLS];
  /* Estimated charge left in the battery, 0 to 1; NaN when no battery is configured. */
  double battery_fraction;
  /* How many cells are in use. */
  uint32_t cell_count;
  /* Bit i set: tip i slides. */
  uint32_t sliding_mask;
  /* Bit k set: the alarm with code k is armed (calibrated, and in a state in which it can detect something). */
  uint32_t armed_mask;
  /* Bit k set: the alarm with code k is raised. */
  uint32_t raised_mask;
} wormd_estimate;

static_assert(sizeof(wormd_estimate) == 984, "wormd_estimate has another size here than in wormd");
static_assert(offsetof(wormd_estimate, state_sequence) == 0, "wormd_estimate.state_sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, time_ns) == 8, "wormd_estimate.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, sample) == 16, "wormd_estimate.sample lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, states_lost) == 24, "wormd_estimate.states_lost lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, phase) == 32, "wormd_estimate.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, position_m) == 40, "wormd_estimate.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, contact_m) == 168, "wormd_estimate.contact_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, deformation_m) == 296, "wormd_estimate.deformation_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, force_n) == 424, "wormd_estimate.force_n lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, forward_slide_m) == 552, "wormd_estimate.forward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, backward_slide_m) == 680, "wormd_estimate.backward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, power_electrical_w) == 808, "wormd_estimate.power_electrical_w lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, energy_electrical_j) == 816, "wormd_estimate.energy_electrical_j lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, energy_loss_j) == 824, "wormd_estimate.energy_loss_j lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, max_deformation_m) == 832, "wormd_estimate.max_deformation_m lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, battery_fraction) == 960, "wormd_estimate.battery_fraction lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, cell_count) == 968, "wormd_estimate.cell_count lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, sliding_mask) == 972, "wormd_estimate.sliding_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, armed_mask) == 976, "wormd_estimate.armed_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_estimate, raised_mask) == 980, "wormd_estimate.raised_mask lies elsewhere in wormd");

/* One finished gait cycle, with the model's prediction beside the measurement. */
typedef struct wormd_cycle {
  /* Number of the cycle since crawling began, from 0. */
  uint64_t index;
  /* When the cycle ended, ns of CLOCK_MONOTONIC. */
  uint64_t end_ns;
  /* How long the cycle took, s. */
  double duration_s;
  /* Part of it in which the computer paused and did not run the controller, s: 0 in an undisturbed cycle. The
     energies leave out time in which a simulated motor stood still. */
  double host_paused_s;
  /* Distance travelled: mean over the cells of the net displacement, m. */
  double advance_m;
  /* Standard error of the advance, m. */
  double advance_sigma_m;
  /* Distance each tip slid forward, m. */
  double forward_slide_m[WORMD_MAX_CELLS];
  /* Distance each tip slid backward, m, counted positive. */
  double backward_slide_m[WORMD_MAX_CELLS];
  /* Energy by losses and weight, equation (11), J; NaN when the tracker was silent, like everything measured
     by positions. */
  double energy_loss_j;
  /* Standard error of energy_loss_j, J. */
  double energy_loss_sigma_j;
  /* Net actuator work, equation (13), J. */
  double energy_actuator_net_j;
  /* Positive part of the actuator work (13), the cost for a drive without energy recovery, J. */
  double energy_actuator_positive_j;
  /* Standard error of the two actuator energies, J. */
  double energy_actuator_sigma_j;
  /* Electrical energy into the motor, J. */
  double energy_electrical_j;
  /* Part of it that heated the winding, ∫ I² R dt, J. */
  double energy_copper_j;
  /* Part of it lost to friction inside the device: what remains after copper and locomotion, J. */
  double energy_friction_inside_j;
  /* Standard error of the electrical energies, J. */
  double energy_electrical_sigma_j;
  /* Cost of transport, positive actuator work over weight and distance; NaN without progress. */
  double cot;
  /* Advance that the model predicts, m; NaN where it predicts sliding down. */
  double predicted_advance_m;
  /* Energy by (11) that the model predicts, J. */
  double predicted_energy_loss_j;
  /* Positive actuator work that the model predicts, J. */
  double predicted_energy_positive_j;
  /* Forward slide of each tip that the model predicts, m. */
  double predicted_forward_slide_m[WORMD_MAX_CELLS];
  /* Backward slide of each tip that the model predicts, m. */
  double predicted_backward_slide_m[WORMD_MAX_CELLS];
  /* Tracker samples in the cycle. */
  uint32_t samples;
  /* How many cells are in use. */
  uint32_t cell_count;
  /* 1 when every tip's deformation was known from the start of the cycle. 0 in the cycle in which they were
     found: its figures use a guess of the deformations at its start, and its standard errors include that
     uncertainty. */
  uint32_t settled;
  /* +1 crawling forward, −1 backward. */
  int32_t direction;
} wormd_cycle;

static_assert(sizeof(wormd_cycle) == 680, "wormd_cycle has another size here than in wormd");
static_assert(offsetof(wormd_cycle, index) == 0, "wormd_cycle.index lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, end_ns) == 8, "wormd_cycle.end_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, duration_s) == 16, "wormd_cycle.duration_s lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, host_paused_s) == 24, "wormd_cycle.host_paused_s lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, advance_m) == 32, "wormd_cycle.advance_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, advance_sigma_m) == 40, "wormd_cycle.advance_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, forward_slide_m) == 48, "wormd_cycle.forward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, backward_slide_m) == 176, "wormd_cycle.backward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_loss_j) == 304, "wormd_cycle.energy_loss_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_loss_sigma_j) == 312, "wormd_cycle.energy_loss_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_actuator_net_j) == 320, "wormd_cycle.energy_actuator_net_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_actuator_positive_j) == 328, "wormd_cycle.energy_actuator_positive_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_actuator_sigma_j) == 336, "wormd_cycle.energy_actuator_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_electrical_j) == 344, "wormd_cycle.energy_electrical_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_copper_j) == 352, "wormd_cycle.energy_copper_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_friction_inside_j) == 360, "wormd_cycle.energy_friction_inside_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, energy_electrical_sigma_j) == 368, "wormd_cycle.energy_electrical_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, cot) == 376, "wormd_cycle.cot lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, predicted_advance_m) == 384, "wormd_cycle.predicted_advance_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, predicted_energy_loss_j) == 392, "wormd_cycle.predicted_energy_loss_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, predicted_energy_positive_j) == 400, "wormd_cycle.predicted_energy_positive_j lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, predicted_forward_slide_m) == 408, "wormd_cycle.predicted_forward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, predicted_backward_slide_m) == 536, "wormd_cycle.predicted_backward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, samples) == 664, "wormd_cycle.samples lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, cell_count) == 668, "wormd_cycle.cell_count lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, settled) == 672, "wormd_cycle.settled lies elsewhere in wormd");
static_assert(offsetof(wormd_cycle, direction) == 676, "wormd_cycle.direction lies elsewhere in wormd");

/* One change of one alarm: raised or cleared. */
typedef struct wormd_alarm {
  /* Number of this change since the estimator started. */
  uint64_t sequence;
  /* When it was raised or cleared, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* When its condition began, as estimated, ns of CLOCK_MONOTONIC. */
  uint64_t since_ns;
  /* The monitored quantity at the change, in the unit of the threshold. */
  double value;
  /* The threshold that it passed. */
  double threshold;
  /* Gait phase at the change, cycles; for a model mismatch, the last one at which the gait passed the place
     where it shows. */
  double phase;
  /* The kind of alarm: AlarmKind. A code of enum wormd_alarm_kind. */
  uint32_t kind;
  /* How serious it is: Severity. A code of enum wormd_severity. */
  uint32_t severity;
  /* 1 raised, 0 cleared. */
  uint32_t raised;
  /* The cell concerned, from 0, or WORMD_NONE where it is not a single cell. */
  uint32_t cell;
} wormd_alarm;

static_assert(sizeof(wormd_alarm) == 64, "wormd_alarm has another size here than in wormd");
static_assert(offsetof(wormd_alarm, sequence) == 0, "wormd_alarm.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, time_ns) == 8, "wormd_alarm.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, since_ns) == 16, "wormd_alarm.since_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, value) == 24, "wormd_alarm.value lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, threshold) == 32, "wormd_alarm.threshold lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, phase) == 40, "wormd_alarm.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, kind) == 48, "wormd_alarm.kind lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, severity) == 52, "wormd_alarm.severity lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, raised) == 56, "wormd_alarm.raised lies elsewhere in wormd");
static_assert(offsetof(wormd_alarm, cell) == 60, "wormd_alarm.cell lies elsewhere in wormd");

/* How far and how long the battery lasts if the worm crawls on as in its last cycles: after each gait cycle,
   where a battery is configured. The low and high values bound a 90 % interval. What is kept in reserve does
   not count. */
typedef struct wormd_range {
  /* Number of the gait cycle that it follows, as in the topic cycle. */
  uint64_t index;
  /* When that cycle ended, ns of CLOCK_MONOTONIC. */
  uint64_t end_ns;
  /* Share of the battery's energy that is left, 0 to 1. */
  double charge_share;
  /* Its standard error. */
  double charge_sigma_share;
  /* Energy left above the reserve and above the charge at which the voltage gets too low, J. */
  double energy_left_j;
  /* Lower bound of it, J. */
  double energy_left_low_j;
  /* Upper bound of it, J. */
  double energy_left_high_j;
  /* Energy that a gait cycle takes from the battery: motor, hotel power, loss in the battery, J. */
  double energy_per_cycle_j;
  /* Its standard error, J. */
  double energy_per_cycle_sigma_j;
  /* Distance that a gait cycle advances, m. */
  double advance_per_cycle_m;
  /* Its standard error, m. */
  double advance_per_cycle_sigma_m;
  /* Gait cycles left. */
  double cycles;
  /* Lower bound of them. */
  double cycles_low;
  /* Upper bound of them. */
  double cycles_high;
  /* Distance left, m; 0 where the worm does not advance. */
  double range_m;
  /* Lower bound of it, m. */
  double range_low_m;
  /* Upper bound of it, m. */
  double range_high_m;
  /* Time left, s. */
  double time_s;
  /* Lower bound of it, s. */
  double time_low_s;
  /* Upper bound of it, s. */
  double time_high_s;
  /* The gauge's reading that was taken with this cycle, 0 to 1; NaN without one. */
  double gauge_share;
  /* Gait cycles since the worm began to crawl as it does now, that this rests on besides the model. */
  uint32_t cycles_used;
  /* +1 crawling forward, −1 backward. */
  int32_t direction;
} wormd_range;

static_assert(sizeof(wormd_range) == 176, "wormd_range has another size here than in wormd");
static_assert(offsetof(wormd_range, index) == 0, "wormd_range.index lies elsewhere in wormd");
static_assert(offsetof(wormd_range, end_ns) == 8, "wormd_range.end_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_range, charge_share) == 16, "wormd_range.charge_share lies elsewhere in wormd");
static_assert(offsetof(wormd_range, charge_sigma_share) == 24, "wormd_range.charge_sigma_share lies elsewhere in wormd");
static_assert(offsetof(wormd_range, energy_left_j) == 32, "wormd_range.energy_left_j lies elsewhere in wormd");
static_assert(offsetof(wormd_range, energy_left_low_j) == 40, "wormd_range.energy_left_low_j lies elsewhere in wormd");
static_assert(offsetof(wormd_range, energy_left_high_j) == 48, "wormd_range.energy_left_high_j lies elsewhere in wormd");
static_assert(offsetof(wormd_range, energy_per_cycle_j) == 56, "wormd_range.energy_per_cycle_j lies elsewhere in wormd");
static_assert(offsetof(wormd_range, energy_per_cycle_sigma_j) == 64, "wormd_range.energy_per_cycle_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_range, advance_per_cycle_m) == 72, "wormd_range.advance_per_cycle_m lies elsewhere in wormd");
static_assert(offsetof(wormd_range, advance_per_cycle_sigma_m) == 80, "wormd_range.advance_per_cycle_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_range, cycles) == 88, "wormd_range.cycles lies elsewhere in wormd");
static_assert(offsetof(wormd_range, cycles_low) == 96, "wormd_range.cycles_low lies elsewhere in wormd");
static_assert(offsetof(wormd_range, cycles_high) == 104, "wormd_range.cycles_high lies elsewhere in wormd");
static_assert(offsetof(wormd_range, range_m) == 112, "wormd_range.range_m lies elsewhere in wormd");
static_assert(offsetof(wormd_range, range_low_m) == 120, "wormd_range.range_low_m lies elsewhere in wormd");
static_assert(offsetof(wormd_range, range_high_m) == 128, "wormd_range.range_high_m lies elsewhere in wormd");
static_assert(offsetof(wormd_range, time_s) == 136, "wormd_range.time_s lies elsewhere in wormd");
static_assert(offsetof(wormd_range, time_low_s) == 144, "wormd_range.time_low_s lies elsewhere in wormd");
static_assert(offsetof(wormd_range, time_high_s) == 152, "wormd_range.time_high_s lies elsewhere in wormd");
static_assert(offsetof(wormd_range, gauge_share) == 160, "wormd_range.gauge_share lies elsewhere in wormd");
static_assert(offsetof(wormd_range, cycles_used) == 168, "wormd_range.cycles_used lies elsewhere in wormd");
static_assert(offsetof(wormd_range, direction) == 172, "wormd_range.direction lies elsewhere in wormd");

/* One command that the controller took or refused, and its answer. */
typedef struct wormd_command_record {
  /* Number of this command since the controller started. */
  uint64_t sequence;
  /* When the tick that processed it had its readings, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* The tick that processed it, as in the topic state. */
  uint64_t state_sequence;
  /* Commanded gait cycles per second, negative for backward; 0 means the configured gait. */
  double cycles_per_s;
  /* How long the worm was to crawl at most, s; 0 leaves it to the controller. */
  double limit_s;
  /* The kind of command: CommandKind. A code of enum wormd_command_kind. */
  uint32_t kind;
  /* What became of it: CommandOutcome. A code of enum wormd_command_outcome. */
  uint32_t outcome;
  /* Bit k set: the command concerned the alarm with code k. */
  uint32_t alarm_mask;
  /* Bit k set: the alarm with code k stood in its way, or was acknowledged by it. */
  uint32_t answer_alarm_mask;
  /* The mode after it: Mode. A code of enum wormd_mode. */
  uint32_t mode;
  /* The fault after it: Fault. A code of enum wormd_fault. */
  uint32_t fault;
  /* 1 while whoever started the controller watched over the worm: a crawl without a time of its own then
     lasts as long as that. */
  uint32_t supervised;
  /* User ID of the sender, as the sender gave it. */
  uint32_t user;
  /* Who sent it, as the sender says: a program, or the watcher whose command it passed on. UTF-8; it ends
     with a zero, or with the array. */
  char sender[32];
  /* Gait phase of the tick that processed it, cycles. */
  double phase;
  /* For a mark, where the mean of the cells was said to be along the canal, m; NaN for other commands. */
  double position_m;
  /* For a mark, the standard error of that, m; NaN for other commands. */
  double position_sigma_m;
} wormd_command_record;

static_assert(sizeof(wormd_command_record) == 128, "wormd_command_record has another size here than in wormd");
static_assert(offsetof(wormd_command_record, sequence) == 0, "wormd_command_record.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, time_ns) == 8, "wormd_command_record.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, state_sequence) == 16, "wormd_command_record.state_sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, cycles_per_s) == 24, "wormd_command_record.cycles_per_s lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, limit_s) == 32, "wormd_command_record.limit_s lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, kind) == 40, "wormd_command_record.kind lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, outcome) == 44, "wormd_command_record.outcome lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, alarm_mask) == 48, "wormd_command_record.alarm_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, answer_alarm_mask) == 52, "wormd_command_record.answer_alarm_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, mode) == 56, "wormd_command_record.mode lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, fault) == 60, "wormd_command_record.fault lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, supervised) == 64, "wormd_command_record.supervised lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, user) == 68, "wormd_command_record.user lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, sender) == 72, "wormd_command_record.sender lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, phase) == 104, "wormd_command_record.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, position_m) == 112, "wormd_command_record.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_command_record, position_sigma_m) == 120, "wormd_command_record.position_sigma_m lies elsewhere in wormd");

/* How a trip stands: twice a second, and at every change. Low and high values bound a 90 % interval. Energies
   and what follows from them are not known without a battery. The lists are where the worm is expected if all
   goes on as planned: the way ahead, and the way home. They hold up to 16 points. */
typedef struct wormd_trip_status {
  /* Number of this message since the trip began. */
  uint64_t sequence;
  /* When it was made, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* When the trip began, ns of CLOCK_MONOTONIC. */
  uint64_t started_ns;
  /* When it came into its phase, for its reason, ns of CLOCK_MONOTONIC. */
  uint64_t since_ns;
  /* Distance from home along the route, m. */
  double position_m;
  /* Its standard error, m. */
  double position_sigma_m;
  /* Length of the route, m. */
  double length_m;
  /* Furthest distance from home that the trip is expected to reach, m; where a trip returns already, the
     furthest it has reached. */
  double turn_m;
  /* Length of the present leg that is still ahead, in the direction of the trip, m. */
  double leg_left_m;
  /* Speed of the cam that the trip commands, gait cycles per second, negative for backward; 0 while it
     commands none. */
  double cycles_per_s;
  /* Distance that a gait cycle is expected to advance on the present leg, m. */
  double advance_per_cycle_m;
  /* Its standard error, m. */
  double advance_per_cycle_sigma_m;
  /* Standard deviation of the advance from cycle to cycle, m. */
  double advance_scatter_m;
  /* Energy left in the battery above the reserve of this trip, J. */
  double energy_left_j;
  /* Lower bound of it, J. */
  double energy_left_low_j;
  /* Upper bound of it, J. */
  double energy_left_high_j;
  /* Energy that the way home needs from here, J. */
  double energy_home_j;
  /* Lower bound of it, J. */
  double energy_home_low_j;
  /* Upper bound of it, J. */
  double energy_home_high_j;
  /* Time that the way home takes from here, s. */
  double home_s;
  /* Lower bound of it, s. */
  double home_low_s;
  /* Upper bound of it, s. */
  double home_high_s;
  /* Time until the trip is over, s; not known while it waits. */
  double left_s;
  /* Lower bound of it, s. */
  double left_low_s;
  /* Upper bound of it, s. */
  double left_high_s;
  /* How long ago somebody was last heard, s. */
  double link_age_s;
  /* Silence after which the link counts as lost, s. */
  double link_timeout_s;
  /* Distances from home of the points ahead, m. */
  double point_m[WORMD_MAX_CELLS];
  /* Times from now at which the worm is expected there, s. */
  double point_s[WORMD_MAX_CELLS];
  /* Standard errors of the place at these times, m. */
  double point_sigma_m[WORMD_MAX_CELLS];
  /* What it does: TripPhase. A code of enum wormd_trip_phase. */
  uint32_t phase;
  /* Why: TripReason. A code of enum wormd_trip_reason. */
  uint32_t reason;
  /* What it goes on with when it no longer waits, outbound or returning: TripPhase. A code of enum
     wormd_trip_phase. */
  uint32_t heading;
  /* Alarm behind the reason alarm or fault: AlarmKind, or WORMD_NONE. A code of enum wormd_alarm_kind. */
  uint32_t alarm;
  /* What it does when the link is lost: LinkLoss. A code of enum wormd_link_loss. */
  uint32_t link_loss;
  /* 1 while the link counts as lost, else 0. */
  uint32_t link_is_lost;
  /* 1 where the worm comes home at the end of the route, 0 where the trip ends there. */
  uint32_t return_home;
  /* Number of the present leg, from 1. */
  uint32_t leg;
  /* Legs of the route. */
  uint32_t leg_count;
  /* Points in the lists. */
  uint32_t point_count;
  /* Gait cycles that were measured on this trip. */
  uint32_t cycles;
  /* 1 where only an operator can make it go on: wormd trip resume. */
  uint32_t needs_operator;
  /* Who commanded what it waits for, or how it goes on: a program, or a watcher; empty where nobody did.
     UTF-8; it ends with a zero, or with the array. */
  char by[32];
} wormd_trip_status;

static_assert(sizeof(wormd_trip_status) == 680, "wormd_trip_status has another size here than in wormd");
static_assert(offsetof(wormd_trip_status, sequence) == 0, "wormd_trip_status.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, time_ns) == 8, "wormd_trip_status.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, started_ns) == 16, "wormd_trip_status.started_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, since_ns) == 24, "wormd_trip_status.since_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, position_m) == 32, "wormd_trip_status.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, position_sigma_m) == 40, "wormd_trip_status.position_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, length_m) == 48, "wormd_trip_status.length_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, turn_m) == 56, "wormd_trip_status.turn_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, leg_left_m) == 64, "wormd_trip_status.leg_left_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, cycles_per_s) == 72, "wormd_trip_status.cycles_per_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, advance_per_cycle_m) == 80, "wormd_trip_status.advance_per_cycle_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, advance_per_cycle_sigma_m) == 88, "wormd_trip_status.advance_per_cycle_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, advance_scatter_m) == 96, "wormd_trip_status.advance_scatter_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_left_j) == 104, "wormd_trip_status.energy_left_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_left_low_j) == 112, "wormd_trip_status.energy_left_low_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_left_high_j) == 120, "wormd_trip_status.energy_left_high_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_home_j) == 128, "wormd_trip_status.energy_home_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_home_low_j) == 136, "wormd_trip_status.energy_home_low_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, energy_home_high_j) == 144, "wormd_trip_status.energy_home_high_j lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, home_s) == 152, "wormd_trip_status.home_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, home_low_s) == 160, "wormd_trip_status.home_low_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, home_high_s) == 168, "wormd_trip_status.home_high_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, left_s) == 176, "wormd_trip_status.left_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, left_low_s) == 184, "wormd_trip_status.left_low_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, left_high_s) == 192, "wormd_trip_status.left_high_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, link_age_s) == 200, "wormd_trip_status.link_age_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, link_timeout_s) == 208, "wormd_trip_status.link_timeout_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, point_m) == 216, "wormd_trip_status.point_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, point_s) == 344, "wormd_trip_status.point_s lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, point_sigma_m) == 472, "wormd_trip_status.point_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, phase) == 600, "wormd_trip_status.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, reason) == 604, "wormd_trip_status.reason lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, heading) == 608, "wormd_trip_status.heading lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, alarm) == 612, "wormd_trip_status.alarm lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, link_loss) == 616, "wormd_trip_status.link_loss lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, link_is_lost) == 620, "wormd_trip_status.link_is_lost lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, return_home) == 624, "wormd_trip_status.return_home lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, leg) == 628, "wormd_trip_status.leg lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, leg_count) == 632, "wormd_trip_status.leg_count lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, point_count) == 636, "wormd_trip_status.point_count lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, cycles) == 640, "wormd_trip_status.cycles lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, needs_operator) == 644, "wormd_trip_status.needs_operator lies elsewhere in wormd");
static_assert(offsetof(wormd_trip_status, by) == 648, "wormd_trip_status.by lies elsewhere in wormd");

/* The state of the worm's recorder: once a second and at every change. */
typedef struct wormd_recording_status {
  /* Number of this message since the recorder started. */
  uint64_t sequence;
  /* When it was sent, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* Bytes written, in all files of this recording together. */
  uint64_t bytes;
  /* Messages handed to the log. */
  uint64_t messages;
  /* Messages that were published and did not arrive at the recorder. */
  uint64_t messages_lost;
  /* Files begun. */
  uint64_t files;
  /* RecordingState. A code of enum wormd_recording_state. */
  uint32_t state;
  /* RecordingProblem: why it stopped. A code of enum wormd_recording_problem. */
  uint32_t problem;
} wormd_recording_status;

static_assert(sizeof(wormd_recording_status) == 56, "wormd_recording_status has another size here than in wormd");
static_assert(offsetof(wormd_recording_status, sequence) == 0, "wormd_recording_status.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, time_ns) == 8, "wormd_recording_status.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, bytes) == 16, "wormd_recording_status.bytes lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, messages) == 24, "wormd_recording_status.messages lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, messages_lost) == 32, "wormd_recording_status.messages_lost lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, files) == 40, "wormd_recording_status.files lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, state) == 48, "wormd_recording_status.state lies elsewhere in wormd");
static_assert(offsetof(wormd_recording_status, problem) == 52, "wormd_recording_status.problem lies elsewhere in wormd");

/* What the motor's current alone says of the worm, with standard errors: after each gait cycle crawled
   forward, as soon as it is fitted, at the end of every other cycle, when only the place is new, and after a
   mark. Positions play no part in it, but for those that correct the dead reckoning. */
typedef struct wormd_inferred {
  /* Number of this message since the estimator started. */
  uint64_t sequence;
  /* When it was made, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* When the newest cycle ended, ns of CLOCK_MONOTONIC; 0 before the first. */
  uint64_t end_ns;
  /* The tick with which it was made, as in the topic state. */
  uint64_t state_sequence;
  /* Gait phase at the end of the newest cycle, cycles. */
  double end_phase;
  /* Cycles that were fitted together, forgotten ones counted less. */
  double cycles;
  /* Friction force k·δmax of each cell, N. */
  double friction_n[WORMD_MAX_CELLS];
  /* Standard error of friction_n, N. */
  double friction_sigma_n[WORMD_MAX_CELLS];
  /* Stiffness of each cell, N/m. */
  double stiffness_n_per_m[WORMD_MAX_CELLS];
  /* Standard error of stiffness_n_per_m, N/m. */
  double stiffness_sigma_n_per_m[WORMD_MAX_CELLS];
  /* Distance that each tip slides forward in a cycle, m, by the model. */
  double forward_slide_m[WORMD_MAX_CELLS];
  /* Distance that each tip slides backward in a cycle, m, counted positive. */
  double backward_slide_m[WORMD_MAX_CELLS];
  /* Pull on the body down the canal, N: weight and constant drag together. */
  double pull_n;
  /* Standard error of pull_n, N. */
  double pull_sigma_n;
  /* The slope, rad: as the inertial sensor measured it, or if all the pull is the weight of the stated mass. */
  double slope_rad;
  /* Standard error of slope_rad, rad. */
  double slope_sigma_rad;
  /* Another pull that explains the current as well, N; NaN where there is none. */
  double other_pull_n;
  /* Probability of that other answer; NaN where there is none. */
  double other_probability;
  /* Advance of a cycle, m, by the model. */
  double advance_m;
  /* Standard error of advance_m, m. */
  double advance_sigma_m;
  /* Energy of a cycle by losses and weight, equation (11), J. */
  double energy_loss_j;
  /* Standard error of energy_loss_j, J. */
  double energy_loss_sigma_j;
  /* Net actuator work of a cycle, equation (13), J. */
  double energy_actuator_net_j;
  /* Standard error of energy_actuator_net_j, J. */
  double energy_actuator_net_sigma_j;
  /* Electrical energy of the newest cycle, J. */
  double energy_electrical_j;
  /* Standard error of energy_electrical_j, J. */
  double energy_electrical_sigma_j;
  /* Root mean square of what the model leaves unexplained in the mean torque, N m at the cam. */
  double residual_n_m;
  /* Distance along the canal by dead reckoning, m, at phase: from where the worm began, or as the tracker or
     the last mark counts. */
  double position_m;
  /* Standard error of position_m, m: it grows until a tracker sample or a mark comes. */
  double position_sigma_m;
  /* Gait phase with which this was made, cycles. */
  double phase;
  /* Largest share of a cell's friction that was lost; NaN where none was. */
  double friction_loss_share;
  /* How much more the cam's load is than before, as a pull on the body, N; NaN while nothing has changed. */
  double load_rise_n;
  /* Standard error of one cycle's ln friction, the worst cell's; NaN while no change could be seen. */
  double change_friction_sigma;
  /* Standard error of one cycle's pull, N; NaN while no change could be seen. */
  double change_pull_sigma_n;
  /* Bit i: friction of cell i was lost. */
  uint32_t friction_lost_mask;
  /* Bit i: cell i does not move. */
  uint32_t jammed_mask;
  /* 1 when the load is larger than it was: a pull on the body or friction in the gears. */
  uint32_t more_load;
  /* Bit i: a loss of 30 % of cell i's friction would be seen. */
  uint32_t friction_armed_mask;
  /* Bit i: a jam of cell i would be seen. */
  uint32_t jam_armed_mask;
  /* 1 while more load would be seen. */
  uint32_t load_armed;
  /* Marks that corrected the distance. */
  uint32_t marks;
  /* Cycles at whose end a tracker sample corrected the distance. */
  uint32_t tracker_marks;
  /* InferredStanding. A code of enum wormd_inferred_standing. */
  uint32_t standing;
  /* How many cells are in use. */
  uint32_t cell_count;
  /* 1 when the inertial sensor measured the slope, 0 when it follows from the pull. */
  uint32_t slope_is_measured;
  /* Marks that contradict the dead reckoning and each other: further off than three standard errors. */
  uint32_t contradicting_marks;
  /* Standard error of forward_slide_m and backward_slide_m, m: the largest of all cells'. */
  double slide_sigma_m;
  /* Standard error of friction_loss_share; NaN where none was lost. */
  double friction_loss_sigma;
  /* Standard error of load_rise_n, N; NaN while nothing has changed. */
  double load_rise_sigma_n;
  /* How far the last mark was ahead of the dead reckoning, m; NaN before the first. */
  double mark_off_m;
  /* Standard error of that by mark and dead reckoning together, m; NaN before the first. */
  double mark_off_sigma_m;
} wormd_inferred;

static_assert(sizeof(wormd_inferred) == 1080, "wormd_inferred has another size here than in wormd");
static_assert(offsetof(wormd_inferred, sequence) == 0, "wormd_inferred.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, time_ns) == 8, "wormd_inferred.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, end_ns) == 16, "wormd_inferred.end_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, state_sequence) == 24, "wormd_inferred.state_sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, end_phase) == 32, "wormd_inferred.end_phase lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, cycles) == 40, "wormd_inferred.cycles lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_n) == 48, "wormd_inferred.friction_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_sigma_n) == 176, "wormd_inferred.friction_sigma_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, stiffness_n_per_m) == 304, "wormd_inferred.stiffness_n_per_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, stiffness_sigma_n_per_m) == 432, "wormd_inferred.stiffness_sigma_n_per_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, forward_slide_m) == 560, "wormd_inferred.forward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, backward_slide_m) == 688, "wormd_inferred.backward_slide_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, pull_n) == 816, "wormd_inferred.pull_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, pull_sigma_n) == 824, "wormd_inferred.pull_sigma_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, slope_rad) == 832, "wormd_inferred.slope_rad lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, slope_sigma_rad) == 840, "wormd_inferred.slope_sigma_rad lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, other_pull_n) == 848, "wormd_inferred.other_pull_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, other_probability) == 856, "wormd_inferred.other_probability lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, advance_m) == 864, "wormd_inferred.advance_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, advance_sigma_m) == 872, "wormd_inferred.advance_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_loss_j) == 880, "wormd_inferred.energy_loss_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_loss_sigma_j) == 888, "wormd_inferred.energy_loss_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_actuator_net_j) == 896, "wormd_inferred.energy_actuator_net_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_actuator_net_sigma_j) == 904, "wormd_inferred.energy_actuator_net_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_electrical_j) == 912, "wormd_inferred.energy_electrical_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, energy_electrical_sigma_j) == 920, "wormd_inferred.energy_electrical_sigma_j lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, residual_n_m) == 928, "wormd_inferred.residual_n_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, position_m) == 936, "wormd_inferred.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, position_sigma_m) == 944, "wormd_inferred.position_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, phase) == 952, "wormd_inferred.phase lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_loss_share) == 960, "wormd_inferred.friction_loss_share lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, load_rise_n) == 968, "wormd_inferred.load_rise_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, change_friction_sigma) == 976, "wormd_inferred.change_friction_sigma lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, change_pull_sigma_n) == 984, "wormd_inferred.change_pull_sigma_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_lost_mask) == 992, "wormd_inferred.friction_lost_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, jammed_mask) == 996, "wormd_inferred.jammed_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, more_load) == 1000, "wormd_inferred.more_load lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_armed_mask) == 1004, "wormd_inferred.friction_armed_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, jam_armed_mask) == 1008, "wormd_inferred.jam_armed_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, load_armed) == 1012, "wormd_inferred.load_armed lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, marks) == 1016, "wormd_inferred.marks lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, tracker_marks) == 1020, "wormd_inferred.tracker_marks lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, standing) == 1024, "wormd_inferred.standing lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, cell_count) == 1028, "wormd_inferred.cell_count lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, slope_is_measured) == 1032, "wormd_inferred.slope_is_measured lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, contradicting_marks) == 1036, "wormd_inferred.contradicting_marks lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, slide_sigma_m) == 1040, "wormd_inferred.slide_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, friction_loss_sigma) == 1048, "wormd_inferred.friction_loss_sigma lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, load_rise_sigma_n) == 1056, "wormd_inferred.load_rise_sigma_n lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, mark_off_m) == 1064, "wormd_inferred.mark_off_m lies elsewhere in wormd");
static_assert(offsetof(wormd_inferred, mark_off_sigma_m) == 1072, "wormd_inferred.mark_off_sigma_m lies elsewhere in wormd");

/* The state of the worm's black box: once a second and at every change. */
typedef struct wormd_black_box_status {
  /* Number of this message since the black box started. */
  uint64_t sequence;
  /* When it was sent, ns of CLOCK_MONOTONIC. */
  uint64_t time_ns;
  /* Compressed messages in memory, bytes. */
  uint64_t memory_bytes;
  /* Written since it started, bytes. */
  uint64_t written_bytes;
  /* Boxes begun since it started. */
  uint64_t boxes;
  /* Messages handed to it. */
  uint64_t messages;
  /* Messages that were published and did not arrive at it. */
  uint64_t messages_lost;
  /* RecordingState: stopped while it cannot write. It goes on in memory, and tries again. A code of enum
     wormd_recording_state. */
  uint32_t state;
  /* RecordingProblem: why it cannot write. A code of enum wormd_recording_problem. */
  uint32_t problem;
} wormd_black_box_status;

static_assert(sizeof(wormd_black_box_status) == 64, "wormd_black_box_status has another size here than in wormd");
static_assert(offsetof(wormd_black_box_status, sequence) == 0, "wormd_black_box_status.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, time_ns) == 8, "wormd_black_box_status.time_ns lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, memory_bytes) == 16, "wormd_black_box_status.memory_bytes lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, written_bytes) == 24, "wormd_black_box_status.written_bytes lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, boxes) == 32, "wormd_black_box_status.boxes lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, messages) == 40, "wormd_black_box_status.messages lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, messages_lost) == 48, "wormd_black_box_status.messages_lost lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, state) == 56, "wormd_black_box_status.state lies elsewhere in wormd");
static_assert(offsetof(wormd_black_box_status, problem) == 60, "wormd_black_box_status.problem lies elsewhere in wormd");

/* A request to the controller. */
typedef struct wormd_command {
  /* Gait cycles per second for CommandKind::Crawl, negative for backward; 0 means the configured gait. */
  double cycles_per_s;
  /* For CommandKind::Crawl and CommandKind::Renew, how long the worm may crawl before it holds, s. 0 leaves
     it to the controller: as long as the lease of wormd up lasts, and where nobody holds one
     control.crawl_limit_s. */
  double limit_s;
  /* For CommandKind::Mark, where the mean of the cells is along the canal, m. */
  double position_m;
  /* For CommandKind::Mark, the standard error of that, m; 0 means 5 mm. */
  double position_sigma_m;
  /* CommandKind. A code of enum wormd_command_kind. */
  uint32_t kind;
  /* Bit k set: the command concerns the alarm with code k, for CommandKind::Acknowledge. */
  uint32_t alarm_mask;
  /* User ID of the sender, for the record. */
  uint32_t user;
  /* Padding to a multiple of eight bytes; zero. */
  uint32_t reserved;
  /* Who sends it, for the record: a program, or the person on whose behalf it sends. UTF-8; it ends with a
     zero, or with the array. */
  char sender[32];
} wormd_command;

static_assert(sizeof(wormd_command) == 80, "wormd_command has another size here than in wormd");
static_assert(offsetof(wormd_command, cycles_per_s) == 0, "wormd_command.cycles_per_s lies elsewhere in wormd");
static_assert(offsetof(wormd_command, limit_s) == 8, "wormd_command.limit_s lies elsewhere in wormd");
static_assert(offsetof(wormd_command, position_m) == 16, "wormd_command.position_m lies elsewhere in wormd");
static_assert(offsetof(wormd_command, position_sigma_m) == 24, "wormd_command.position_sigma_m lies elsewhere in wormd");
static_assert(offsetof(wormd_command, kind) == 32, "wormd_command.kind lies elsewhere in wormd");
static_assert(offsetof(wormd_command, alarm_mask) == 36, "wormd_command.alarm_mask lies elsewhere in wormd");
static_assert(offsetof(wormd_command, user) == 40, "wormd_command.user lies elsewhere in wormd");
static_assert(offsetof(wormd_command, reserved) == 44, "wormd_command.reserved lies elsewhere in wormd");
static_assert(offsetof(wormd_command, sender) == 48, "wormd_command.sender lies elsewhere in wormd");

/* The controller's answer. */
typedef struct wormd_reply {
  /* Tick in which the command was processed. */
  uint64_t sequence;
  /* CommandOutcome. A code of enum wormd_command_outcome. */
  uint32_t verdict;
  /* Mode after the command,. A code of enum wormd_mode. */
  uint32_t mode;
  /* Fault. A code of enum wormd_fault. */
  uint32_t fault;
  /* Bit k set: the alarm with code k stands in the way of the command. */
  uint32_t alarm_mask;
} wormd_reply;

static_assert(sizeof(wormd_reply) == 24, "wormd_reply has another size here than in wormd");
static_assert(offsetof(wormd_reply, sequence) == 0, "wormd_reply.sequence lies elsewhere in wormd");
static_assert(offsetof(wormd_reply, verdict) == 8, "wormd_reply.verdict lies elsewhere in wormd");
static_assert(offsetof(wormd_reply, mode) == 12, "wormd_reply.mode lies elsewhere in wormd");
static_assert(offsetof(wormd_reply, fault) == 16, "wormd_reply.fault lies elsewhere in wormd");
static_assert(offsetof(wormd_reply, alarm_mask) == 20, "wormd_reply.alarm_mask lies elsewhere in wormd");

#endif
