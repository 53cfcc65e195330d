#!/usr/bin/env python3
"""Read a worm's state topic from Python, without a copy, while wormd runs.

    pip install iceoryx2==0.10.0
    python3 read_state.py --worm worm1 --count 10

Prints one JSON object a line. A reader needs three things from wormd:
  - the folder and the prefix of the worm's shared memory (`join` below),
  - the name of the service, worm/<name>/state,
  - the layout of the message and its type name, as in crates/worm-estimator/src/message/state.rs
    (`State` below).
iceoryx2 compares name, size and alignment of the type, but not its fields: keep them in step with the Rust struct.
It never disturbs the worm: a reader that falls behind loses samples, the controller does not wait.
"""

import argparse
import binascii
import ctypes
import json
import os
import sys
import time

MAX_CELLS = 16


class State(ctypes.Structure):
    """What the controller measured and commanded in one tick; crates/worm-estimator/src/message/state.rs documents each field."""

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
        ("position_m", ctypes.c_double * MAX_CELLS),
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
    ]

    @staticmethod
    def type_name():
        return "wormd_state_v3"


def join(worm, root):
    """Returns iceoryx2's configuration for one worm, or ends the program with what to do."""
    import iceoryx2 as iox2

    root = os.path.realpath(root)
    folder = os.path.join(root, worm)
    if not os.path.isdir(folder):
        sys.exit(f"{folder} is not there: start the worm with `wormd up`, or give its --worm and --root")
    config = iox2.config.default()
    config.global_cfg.root_path = iox2.Path.new(folder)
    config.global_cfg.prefix = iox2.FileName.new(f"wormd_{worm}_{binascii.crc_hqx(root.encode(), 0):04x}_")
    # wormd cleans up after killed processes; doing it here too could take long.
    config.global_cfg.node.cleanup_dead_nodes_on_creation = False
    config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
    config.global_cfg.service.cleanup_dead_nodes_on_open = False
    return config


def states(worm, root, timeout_s):
    """Yields the worm's states as they come; ends when none has come for `timeout_s`."""
    import iceoryx2 as iox2

    iox2.set_log_level(iox2.LogLevel.Error)
    node = iox2.NodeBuilder.new().config(join(worm, root)).create(iox2.ServiceType.Ipc)
    name = iox2.ServiceName.new(f"worm/{worm}/state")
    try:
        event = node.service_builder(name).event().open()
        topic = node.service_builder(name).publish_subscribe(State).open()
    except (iox2.EventOpenError, iox2.PublishSubscribeOpenError) as error:
        sys.exit(f"worm/{worm}/state: {error}: is the worm running, and of the same version as this program?")
    listener = event.listener_builder().create()
    subscriber = topic.subscriber_builder().history_request(1).create()
    received_s = time.monotonic()
    while time.monotonic() - received_s < timeout_s:
        listener.timed_wait(iox2.Duration.from_millis(100))
        while (sample := subscriber.receive()) is not None:
            received_s = time.monotonic()
            yield sample.payload().contents
            sample.delete()


def auto_root(worm):
    """The folder that `topics.root = "auto"` stands for; `wormd check` names it."""
    user = os.geteuid()
    if user == 0:
        return "/dev/shm/wormd"
    runtime = f"/run/user/{user}"
    root = f"{runtime}/wormd"
    is_own = os.path.isdir(runtime) and os.stat(runtime).st_uid == user
    return root if is_own and len(root) + 2 * len(worm) <= 48 else f"/dev/shm/wormd-{user}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worm", default="worm1", help="worm.name of the configuration")
    parser.add_argument("--root", default="auto", help="topics.root of the configuration")
    parser.add_argument("--count", type=int, default=10, help="how many states to print")
    parser.add_argument("--timeout", type=float, default=5.0, help="give up after this many seconds without one")
    parser.add_argument("--layout", action="store_true", help="print offset and size of each field, and end")
    arguments = parser.parse_args()
    if arguments.layout:
        fields = {name: getattr(State, name) for name, _ in State._fields_}
        print(json.dumps({name: [field.offset, field.size] for name, field in fields.items()}))
        return
    printed = 0
    root = auto_root(arguments.worm) if arguments.root == "auto" else arguments.root
    for state in states(arguments.worm, root, arguments.timeout):
        if printed == arguments.count:
            return
        printed += 1
        positions_mm = [round(1e3 * state.position_m[cell], 3) for cell in range(state.cell_count)]
        print(json.dumps({"sequence": state.sequence, "phase": state.phase, "positions_mm": positions_mm}), flush=True)
    if printed < arguments.count:
        sys.exit(f"worm/{arguments.worm}/state: nothing published for {arguments.timeout} s: is its controller running?")


if __name__ == "__main__":
    main()
