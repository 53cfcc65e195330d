"""Talks to `wormd virtual-worm` with the maker's own SDK (pip install dynamixel-sdk).

Usage: python3 official_sdk.py PORT. Ends with status 0 when everything is as the XL330-M288 e-manual says.
"""

import statistics
import sys
import time

from dynamixel_sdk import port_handler
from dynamixel_sdk import (
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
)

SERVO, TRACKER = 1, 100
INSTRUCTION, RANGE, LENGTH, LIMIT, ACCESS = 2, 4, 5, 6, 7

# The SDK gives an answer 34 ms, by this computer's clock: too little for a computer that pauses.
port_handler.LATENCY_TIMER = 400

port = PortHandler(sys.argv[1])
assert port.openPort(), "the port does not open"
assert port.setBaudRate(1000000)
bus = PacketHandler(2.0)


def done(answer):
    """The data of an answer that must be good."""
    *data, result, error = answer
    assert result == COMM_SUCCESS, bus.getTxRxResult(result)
    assert error == 0, bus.getRxPacketError(error)
    return data[0] if data else None


def refused(answer, expected):
    result, error = answer
    assert result == COMM_SUCCESS, bus.getTxRxResult(result)
    assert error == expected, (error, expected)


def signed(value, size):
    return value - (1 << 8 * size) if value >> (8 * size - 1) else value


def wait_for(what, condition, pause_s=0.02):
    """Waits until it holds: how long that takes is the computer's matter, not the worm's."""
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(pause_s)


def velocity():
    return signed(done(bus.read4ByteTxRx(port, SERVO, 128)), 4)


def motor_ms():
    """The servo's own clock."""
    return done(bus.read2ByteTxRx(port, SERVO, 120))


# Who is there?
assert done(bus.ping(port, SERVO)) == 1200
assert done(bus.ping(port, TRACKER)) == 0x574D
found, result = bus.broadcastPing(port)
assert result == COMM_SUCCESS and sorted(found) == [SERVO, TRACKER], (found, result)
assert found[SERVO][0] == 1200 and found[TRACKER][0] == 0x574D
_, result, _ = bus.ping(port, 42)
assert result != COMM_SUCCESS, "nobody has ID 42"

# Status errors.
refused(bus.write2ByteTxRx(port, SERVO, 0, 7), ACCESS)
refused(bus.write1ByteTxRx(port, SERVO, 11, 2), RANGE)
refused(bus.write2ByteTxRx(port, SERVO, 104, 7), LENGTH)
refused(bus.write4ByteTxRx(port, SERVO, 104, 1000), LIMIT)
refused(bus.clearMultiTurn(port, TRACKER), INSTRUCTION)

# Velocity mode, torque on; EEPROM is locked then.
done(bus.write1ByteTxRx(port, SERVO, 9, 0))
done(bus.write1ByteTxRx(port, SERVO, 11, 1))
assert done(bus.read1ByteTxRx(port, SERVO, 11)) == 1
done(bus.write1ByteTxRx(port, SERVO, 64, 1))
refused(bus.write1ByteTxRx(port, SERVO, 11, 1), ACCESS)

# The cam turns: one revolution in 2.5 s of the servo's time, which is real time but for pauses of the computer.
began = time.monotonic()
began_ms = motor_ms()
start = signed(done(bus.read4ByteTxRx(port, SERVO, 132)), 4)
done(bus.write4ByteTxRx(port, SERVO, 104, 105))
wait_for("a second of the servo's time", lambda: (motor_ms() - began_ms) % 32768 >= 1000)
assert abs(velocity() - 105) <= 2
turned = signed(done(bus.read4ByteTxRx(port, SERVO, 132)), 4) - start
passed_s = (motor_ms() - began_ms) % 32768 * 1e-3
assert abs(turned - 4096 / 2.5 * passed_s) < 250, (turned, passed_s)
assert passed_s < time.monotonic() - began + 0.01, "the servo's clock never goes faster than real time"
assert 45 <= done(bus.read2ByteTxRx(port, SERVO, 144)) <= 50
assert 50 < signed(done(bus.read2ByteTxRx(port, SERVO, 126)), 2) < 400

# Sync and bulk reads, plain and fast.
for fast in (False, True):
    read = GroupSyncRead(port, bus, 128, 8)
    assert read.addParam(SERVO)
    result = read.fastSyncRead() if fast else read.txRxPacket()
    assert result == COMM_SUCCESS, (fast, bus.getTxRxResult(result))
    assert read.isAvailable(SERVO, 132, 4)
    assert abs(signed(read.getData(SERVO, 128, 4), 4) - 105) <= 2
    both = GroupSyncRead(port, bus, 0, 7)
    assert both.addParam(SERVO) and both.addParam(TRACKER)
    result = both.fastSyncRead() if fast else both.txRxPacket()
    assert result == COMM_SUCCESS, (fast, bus.getTxRxResult(result))
    assert both.getData(SERVO, 0, 2) == 1200 and both.getData(TRACKER, 0, 2) == 0x574D

    bulk = GroupBulkRead(port, bus)
    assert bulk.addParam(SERVO, 98, 49) and bulk.addParam(TRACKER, 128, 27)
    result = bulk.fastBulkRead() if fast else bulk.txRxPacket()
    assert result == COMM_SUCCESS, (fast, bus.getTxRxResult(result))
    assert abs(signed(bulk.getData(SERVO, 128, 4), 4) - 105) <= 2
    assert bulk.getData(TRACKER, 136, 1) == 4 and bulk.getData(TRACKER, 137, 2) == 0b1111
    cells = [signed(bulk.getData(TRACKER, 139 + 4 * cell, 4), 4) for cell in range(4)]
    assert all(front > behind for front, behind in zip(cells, cells[1:])), cells

# Sync and bulk writes, registered writes.
sync_write = GroupSyncWrite(port, bus, 65, 1)
assert sync_write.addParam(SERVO, [1]) and sync_write.txPacket() == COMM_SUCCESS
assert done(bus.read1ByteTxRx(port, SERVO, 65)) == 1
bulk_write = GroupBulkWrite(port, bus)
assert bulk_write.addParam(SERVO, 65, 1, [0]) and bulk_write.txPacket() == COMM_SUCCESS
assert done(bus.read1ByteTxRx(port, SERVO, 65)) == 0
done(bus.regWriteTxRx(port, SERVO, 65, 1, [1]))
assert done(bus.read1ByteTxRx(port, SERVO, 65)) == 0
bus.action(port, SERVO)
time.sleep(0.1)
port.clearPort()
assert done(bus.read1ByteTxRx(port, SERVO, 65)) == 1

# The bus watchdog stops the motor when the controller falls silent.
done(bus.write1ByteTxRx(port, SERVO, 98, 5))
time.sleep(0.3)
# Each question feeds the watchdog.
wait_for("the watchdog", lambda: done(bus.read1ByteTxRx(port, SERVO, 98)) == 0xFF, pause_s=0.3)
wait_for("the motor stands", lambda: velocity() == 0)
refused(bus.write4ByteTxRx(port, SERVO, 104, 50), RANGE)
done(bus.write1ByteTxRx(port, SERVO, 98, 0))
done(bus.write4ByteTxRx(port, SERVO, 104, 50))
wait_for("the motor turns again", lambda: abs(velocity() - 50) <= 2)

# Status return level 1: writes are not answered, reads are.
bus.write1ByteTxOnly(port, SERVO, 68, 1)
time.sleep(0.1)
port.clearPort()
result, _ = bus.write1ByteTxRx(port, SERVO, 65, 0)
assert result != COMM_SUCCESS
assert done(bus.read1ByteTxRx(port, SERVO, 65)) == 0

# A reboot loses torque and return level.
bus.reboot(port, SERVO)
wait_for("the servo is back", lambda: bus.ping(port, SERVO)[1] == COMM_SUCCESS)
port.clearPort()
assert done(bus.read1ByteTxRx(port, SERVO, 64)) == 0
assert done(bus.read1ByteTxRx(port, SERVO, 68)) == 2
assert done(bus.read1ByteTxRx(port, SERVO, 11)) == 1, "EEPROM is kept"

# A peer that closes and comes again.
port.closePort()
assert port.openPort() and done(bus.ping(port, SERVO)) == 1200

took_us = []
for _ in range(200):
    began = time.perf_counter()
    done(bus.read4ByteTxRx(port, SERVO, 132))
    took_us.append((time.perf_counter() - began) * 1e6)
print(f"all as the manual says; a read through the SDK takes {statistics.median(took_us):.0f} us (median)")
port.closePort()
