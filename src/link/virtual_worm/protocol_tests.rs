//! Instructions, access rules and the order of answers.

use super::device_harness::*;
use crate::link::Register;
use crate::link::servo::register;
use crate::link::tracker;
use dynamixel_bus::packet::{
    BackupAction, Decoder, Instruction, InstructionPacket, MAX_PACKET_LEN, Packet, ReadSpan, ReadSpans, Recipient,
    ResetScope, SyncWrites,
};

#[test]
fn pings_are_answered_in_the_order_of_the_ids() {
    let mut harness = harness(&[]);
    let identity = |model: u16, firmware: u8| (0, [&model.to_le_bytes()[..], &[firmware]].concat());
    assert_eq!(harness.ask_one(SERVO, Instruction::Ping), identity(1200, 53));
    assert_eq!(harness.ask_one(TRACKER, Instruction::Ping), identity(tracker::MODEL, 1));
    let all = [(SERVO, identity(1200, 53)), (TRACKER, identity(tracker::MODEL, 1))];
    assert_eq!(harness.ask(254, Instruction::Ping), all);
    assert_eq!(harness.ask(7, Instruction::Ping), []);
    assert_eq!(harness.write(register::ID, 200), 0);
    let swapped = [(TRACKER, identity(tracker::MODEL, 1)), (200, identity(1200, 53))];
    assert_eq!(harness.ask(254, Instruction::Ping), swapped);
}

/// Error codes: 1 result fail, 2 instruction, 4 range, 5 length, 6 limit, 7 access.
#[test]
fn access_rules() {
    let mut harness = harness(&[]);
    let writes: &[(u16, &[u8], u8)] = &[
        (0, &[1, 0], 7),                     // model number is read-only
        (132, &[0, 0, 0, 0], 7),             // so is the present position
        (14, &[0], 7),                       // a gap
        (147, &[0], 7),                      // backup ready
        (148, &[0], 7),                      // behind the table
        (65535, &[0], 7),                    // far behind it
        (105, &[0], 7),                      // in the middle of a register
        (104, &[1, 0], 5),                   // two bytes into a register of four
        (11, &[2], 4),                       // no such operating mode
        (11, &[5], 4),                       // one that the virtual servo does not have
        (64, &[2], 4),                       // torque is on or off
        (68, &[3], 4),                       // return levels are 0 to 2
        (98, &[128], 4),                     // watchdogs end at 127
        (36, &[118, 3], 4),                  // 886 of 885
        (104, &[0xBE, 1, 0, 0], 6),          // 446 beyond the velocity limit of 445
        (104, &[0x43, 0xFE, 0xFF, 0xFF], 0), // −445 is not
        (11, &[1], 0),
        (64, &[1], 0), // torque on
        (11, &[1], 7), // locks EEPROM
        (9, &[0], 7),
        (65, &[1], 0), // but not RAM
        (64, &[0], 0),
        (9, &[0], 0),
        (76, &[0x40, 6, 0xB4, 0], 0), // two registers at once
        (84, &[1, 0, 0], 7),          // one and into a gap
    ];
    for &(address, data, expected) in writes {
        let (error, _) = harness.ask_one(SERVO, Instruction::Write { address, data });
        assert_eq!(error, expected, "{data:?} at {address}");
    }
    for (address, length, expected, len) in [
        (0, 147, 0, 147),
        (14, 2, 0, 2),
        (147, 2, 7, 0),
        (148, 1, 7, 0),
        (0, 0, 5, 0),
    ] {
        let (error, data) = harness.ask_one(SERVO, Instruction::Read { address, length });
        assert_eq!((error, data.len()), (expected, len), "{length} at {address}");
    }
    assert_eq!(
        harness
            .ask_one(
                TRACKER,
                Instruction::Write {
                    address: 128,
                    data: &[0]
                }
            )
            .0,
        7
    );
    assert_eq!(harness.ask_one(TRACKER, Instruction::ClearMultiTurn).0, 2);
    // Nothing of a refused write happens.
    let before = harness.read(register::GOAL_VELOCITY);
    assert_eq!(
        harness
            .ask_one(
                SERVO,
                Instruction::Write {
                    address: 104,
                    data: &[1, 0, 0, 0, 255, 255, 255, 255]
                }
            )
            .0,
        4
    );
    assert_eq!(harness.read(register::GOAL_VELOCITY), before);
}

#[test]
fn damaged_and_unknown_instructions_are_answered_as_the_manual_says() {
    let mut harness = harness(&[]);
    let ping_with_wrong_crc = [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 1, 0x19, 0x4F];
    assert_eq!(
        statuses(&harness.exchange(&ping_with_wrong_crc)),
        [(SERVO, (3, vec![]))]
    );
    let mut unknown = vec![0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 0x77];
    unknown.extend(crc::Crc::<u16>::new(&crc::CRC_16_UMTS).checksum(&unknown).to_le_bytes());
    assert_eq!(statuses(&harness.exchange(&unknown)), [(SERVO, (2, vec![]))]);
    // A packet that never ends does not swallow the next one.
    assert!(harness.exchange(&[0xFF, 0xFF, 0xFD, 0, 1, 200, 0, 2]).is_empty());
    harness.wait(0.02);
    assert_eq!(harness.ask(SERVO, Instruction::Ping).len(), 1);
}

#[test]
fn status_return_level_says_what_is_answered() {
    let mut harness = harness(&[]);
    let read = Instruction::Read { address: 7, length: 1 };
    let write = Instruction::Write {
        address: 65,
        data: &[1],
    };
    for (level, reads, writes) in [(2u8, 1, 1), (1, 1, 0), (0, 0, 0)] {
        harness.ask(
            SERVO,
            Instruction::Write {
                address: 68,
                data: &[level],
            },
        );
        assert_eq!(harness.ask(SERVO, Instruction::Ping).len(), 1, "level {level}");
        assert_eq!(harness.ask(SERVO, read).len(), reads, "level {level}");
        assert_eq!(harness.ask(SERVO, write).len(), writes, "level {level}");
    }
}

#[test]
fn registered_writes_wait_for_the_action() {
    let mut harness = harness(&[]);
    assert_eq!(
        harness.ask_one(SERVO, Instruction::Action).0,
        2,
        "nothing is registered"
    );
    assert_eq!(
        harness
            .ask_one(
                SERVO,
                Instruction::RegWrite {
                    address: 65,
                    data: &[1]
                }
            )
            .0,
        0
    );
    assert_eq!(harness.read(Register::new(69, 1, "registered instruction")), 1);
    assert_eq!(harness.read(Register::new(65, 1, "LED")), 0);
    assert_eq!(harness.ask(254, Instruction::Action), [], "a broadcast is not answered");
    assert_eq!(harness.read(Register::new(65, 1, "LED")), 1);
    assert_eq!(
        harness
            .ask_one(SERVO, Instruction::RegWrite { address: 0, data: &[1] })
            .0,
        7
    );
}

fn span(device: u8, address: u16, length: u16) -> [u8; 5] {
    let id = id(device);
    ReadSpan { id, address, length }.to_wire()
}

#[test]
fn sync_and_bulk_reads_answer_in_the_order_asked_and_stop_at_the_first_silent_device() {
    let mut harness = harness(&[]);
    let order = |answers: Vec<(u8, Answer)>| answers.iter().map(|(id, _)| *id).collect::<Vec<_>>();
    let sync = |ids| Instruction::SyncRead {
        address: 0,
        length: 2,
        ids,
    };
    assert_eq!(order(harness.ask(254, sync(&[100, 1]))), [100, 1]);
    assert_eq!(order(harness.ask(254, sync(&[1, 100]))), [1, 100]);
    assert_eq!(order(harness.ask(254, sync(&[1, 7, 100]))), [1]);
    let spans = [span(100, 128, 27), span(1, 132, 4)];
    let bulk = Instruction::BulkRead(ReadSpans::new(&spans).expect("spans"));
    let answers = harness.ask(254, bulk);
    assert_eq!((answers[0].0, answers[0].1.1.len()), (100, 27));
    assert_eq!((answers[1].0, answers[1].1.1.len()), (1, 4));
}

#[test]
fn fast_reads_answer_together_and_end_early() {
    for (faults, good) in [
        (&[][..], 2),
        (&["silence:device=tracker"][..], 1),
        (&["silence:device=servo"][..], 0),
    ] {
        let mut harness = harness(faults);
        let wire = [span(1, 98, 49), span(100, 128, 27)];
        let spans = ReadSpans::new(&wire).expect("spans");
        let packet = InstructionPacket {
            recipient: Recipient::All,
            instruction: Instruction::FastBulkRead(spans),
        };
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        let bytes = harness.exchange(&out[..len]);
        let mut decoder = Decoder::new();
        decoder.push(&bytes);
        let reply = match decoder.next_packet() {
            Some(Ok(Packet::FastReply(reply))) => Some(reply),
            _ => decoder.unfinished_fast_reply(),
        };
        let segments: Vec<_> = reply
            .into_iter()
            .flat_map(|reply| reply.segments(spans.iter()))
            .collect();
        assert_eq!(
            segments.iter().filter(|segment| segment.is_ok()).count(),
            good,
            "{faults:?}"
        );
    }
}

#[test]
fn factory_reset_and_backup() {
    let mut harness = harness(&[]);
    assert_eq!(harness.write(register::VELOCITY_LIMIT, 200), 0);
    assert_eq!(
        harness
            .ask_one(SERVO, Instruction::ControlTableBackup(BackupAction::Store))
            .0,
        0
    );
    assert_eq!(harness.write(register::ID, 5), 0);
    assert_eq!(harness.ask_one(5, Instruction::FactoryReset(ResetScope::AllButId)).0, 0);
    harness.wait(0.2);
    assert_eq!(
        harness.ask_one(5, Instruction::Read { address: 44, length: 2 }),
        (0, vec![189, 1])
    );
    assert_eq!(
        harness
            .ask_one(5, Instruction::ControlTableBackup(BackupAction::Restore))
            .0,
        0
    );
    harness.wait(0.2);
    assert_eq!(
        harness.ask_one(1, Instruction::Read { address: 44, length: 2 }),
        (0, vec![200, 0])
    );
    assert_eq!(
        harness.ask(254, Instruction::FactoryReset(ResetScope::All)),
        [],
        "refused as a broadcast"
    );
    assert_eq!(harness.read(register::VELOCITY_LIMIT), 200);
}

#[test]
fn sync_and_bulk_writes_are_obeyed_in_silence() {
    let mut harness = harness(&[]);
    let writes = [SERVO, 1];
    let writes = SyncWrites::new(1, &writes).expect("whole");
    assert_eq!(harness.ask(254, Instruction::SyncWrite { address: 65, writes }), []);
    assert_eq!(harness.read(Register::new(65, 1, "LED")), 1);
}

#[test]
fn return_delay_holds_the_answer_back() {
    let mut harness = harness(&[]);
    let ping = [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 1, 0x19, 0x4E];
    let at_once = harness.send(&ping);
    assert!(at_once.is_empty(), "250 counts of 2 µs as it comes from the factory");
    assert_eq!(harness.devices.next_due_s(), Some(5e-4));
    let mut answer = Vec::new();
    harness.devices.take_due(5e-4, &mut answer);
    assert_eq!(statuses(&answer).len(), 1);
    assert_eq!(harness.write(register::RETURN_DELAY, 0), 0);
    harness.now_s = 1.0;
    assert_eq!(statuses(&harness.send(&ping)).len(), 1);
}
