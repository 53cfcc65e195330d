//! Makes the fuzzer's corpora, from this project's own writers: `cargo run -p fuzz-targets --example make_corpus -- fuzz/corpus`.
//! Inputs that once broke a reader lie beside them and stay.

use dynamixel_bus::packet::{
    DeviceId, FastReplyWriter, FastSegment, Instruction, InstructionPacket, ReadSpan, ReadSpans, Recipient,
    StatusFlags, StatusPacket,
};
use std::fmt::Write;
use std::path::Path;
use testkit::log_sample::{Sink, Telemetry, crawl, origin};
use testkit::recording_files::{as_csv, crawl as scene, simulated};
use worm_analysis::experiment::Simulation;
use worm_estimator::message::{
    Command, CommandKind, CommandOutcome, CommandRecord, JsonMessage, Mode, ProtobufMessage, Reply, ShortText,
};
use worm_log::{Channel, Logged, Writer};

fn main() {
    let folder = std::env::args().nth(1).expect("give the folder of the corpora");
    let put = |target: &str, name: &str, bytes: &[u8]| {
        let folder = Path::new(&folder).join(target);
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        std::fs::write(folder.join(name), bytes).expect("the corpus can be written");
    };
    put("packets", "transactions", &transactions());
    put("tracker_table", "answers", &answers());
    put("config_toml", "effects", CONFIG.as_bytes());
    put("campaign_toml", "advances", ADVANCES.as_bytes());
    put("campaign_toml", "recordings", RECORDINGS.as_bytes());
    put("route_csv", "legs", ROUTE.as_bytes());
    let short = Simulation {
        rate_hz: 10.0,
        cycles: 1.0,
        ..scene()
    };
    put("recording_csv", "crawl", as_csv(&simulated(&short)).as_bytes());
    put("vicon_csv", "crawl", vicon(&short).as_bytes());
    put("c3d", "crawl", &c3d(&short, false));
    put("c3d", "crawl_in_integers", &c3d(&short, true));
    let telemetry = crawl(0.03);
    put("mcap_log", "crawl", &log(&telemetry, Encoding::Json));
    put("mcap_log", "crawl_in_protobuf", &log(&telemetry, Encoding::Protobuf));
    put("mcap_log", "crawl_compressed", &compressed_log(&telemetry));
    put("protobuf_message", "state", &protobuf(0, &telemetry.states[9]));
    put("protobuf_message", "timing", &protobuf(1, &telemetry.timings[9]));
    put("protobuf_message", "estimate", &protobuf(2, &telemetry.estimates[1]));
    put("protobuf_message", "command", &protobuf(5, &refused_crawl()));
    put("log_messages", "crawl", &messages(&telemetry));
}

const ROUTE: &str = "# there and back\nlength_m,slope_deg\n2.5,0\n0.8,30\n1e-1,-12.5\n";

fn device(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

/// A few packets of each kind, cut into pieces of 7 bytes.
fn transactions() -> Vec<u8> {
    let spans = [(1, 98, 49), (100, 128, 27)].map(|(id, address, length)| {
        ReadSpan {
            id: device(id),
            address,
            length,
        }
        .to_wire()
    });
    let mut stream = vec![7];
    let mut buffer = [0; 512];
    for instruction in [
        Instruction::Ping,
        Instruction::Read {
            address: 98,
            length: 49,
        },
        Instruction::Write {
            address: 104,
            data: &[0xFF, 0xFF, 0xFD, 0x00],
        },
        Instruction::SyncRead {
            address: 128,
            length: 27,
            ids: &[1, 100],
        },
        Instruction::FastBulkRead(ReadSpans::from_valid(&spans)),
        Instruction::ClearMultiTurn,
    ] {
        let recipient = Recipient::All;
        let len = InstructionPacket { recipient, instruction }
            .encode(&mut buffer)
            .expect("it fits");
        stream.extend(&buffer[..len]);
    }
    let status = StatusPacket {
        id: device(1),
        flags: StatusFlags::from_wire(0x80),
        data: &[0xB0, 0x04, 52],
    };
    let len = status.encode(&mut buffer).expect("it fits");
    stream.extend(&buffer[..len]);
    let mut writer = FastReplyWriter::new(&mut buffer, [49, 27].into_iter()).expect("it fits");
    for (id, data) in [(1, &[3; 49][..]), (100, &[5; 27])] {
        let flags = StatusFlags::from_wire(0);
        writer
            .push(FastSegment {
                id: device(id),
                flags,
                data,
            })
            .expect("as announced");
    }
    let len = writer.len();
    stream.extend(&buffer[..len]);
    stream
}

/// Answers of both devices: a fast reply, and status packets.
fn answers() -> Vec<u8> {
    let mut bytes = vec![2, 77, 0];
    bytes.extend((0..76).map(|byte| byte * 3));
    for (id, length) in [(1, 49), (100, 27)] {
        bytes.extend([1, length + 2, id, 0]);
        bytes.extend((0..length).map(|byte| byte * 5));
    }
    bytes
}

const CONFIG: &str = "\
[worm]
name = \"fuzzed\"
cells = 3
stiffness_n_per_m = [900.0, 950.0, 1000.0]
step_order = [1, 3, 2]
[[effect]]
name = \"constant-drag\"
force_n = 0.2
[[effect]]
name = \"lost-stroke\"
length_m = 0.001
cell = 2
[canal]
slope_deg = -5
[battery]
capacity_j = 20000.0
full_v = 4.2
empty_v = 3.3
internal_resistance_ohm = 0.1
hotel_power_w = 1.0
reserve_share = 0.2
";

const ADVANCES: &str = "\
[[run]]
slope_deg = 0
advance_m = 0.0071
advance_sigma_m = 1e-4
[[run]]
slope_deg = 10.5
payload_kg = 0.1
cycle_s = 3.0
advance_m = -0.0051
advance_sigma_m = 0.0001
";

const RECORDINGS: &str = "\
worm = \"worm.toml\"
[[run]]
recording = \"flat.csv\"
slope_deg = 0
[[run]]
recording = \"sub/steep.mcap\"
slope_deg = 20.0
payload_kg = 0.25
";

fn vicon(simulation: &Simulation) -> String {
    let recording = simulated(simulation);
    let cells = recording.cells();
    let mut text = format!("Trajectories\n{}\n", simulation.rate_hz);
    let row = |first: &str, of: &dyn Fn(usize) -> String| {
        let columns: Vec<String> = (0..cells).map(of).collect();
        format!("{first},{}\n", columns.join(","))
    };
    text += &row(",", &|cell| format!("Worm:c{},,", cell + 1));
    text += &row("Frame,Sub Frame", &|_| "X,Y,Z".to_owned());
    text += &row(",", &|_| "mm,mm,mm".to_owned());
    for sample in 0..recording.samples() {
        write!(text, "{},0", sample + 1).expect("a string takes all");
        for series in &recording.position_m {
            write!(text, ",{:.3},2.5,30", series[sample] * 1e3).expect("a string takes all");
        }
        text.push('\n');
    }
    text
}

/// The smallest C3D file that holds markers.
fn c3d(simulation: &Simulation, in_integers: bool) -> Vec<u8> {
    const BLOCK: usize = 512;
    let recording = simulated(simulation);
    let (cells, frames) = (recording.cells(), recording.samples());
    let scale: f32 = if in_integers { 0.05 } else { -1.0 };
    let mut header = vec![2, 0x50];
    for word in [cells, 0, 1, frames, 10] {
        header.extend((word as u16).to_le_bytes());
    }
    header.extend(scale.to_le_bytes());
    for word in [3u16, 0] {
        header.extend(word.to_le_bytes());
    }
    header.extend((simulation.rate_hz as f32).to_le_bytes());
    header.resize(BLOCK, 0);
    let mut parameters = vec![1, 0x50, 1, 84];
    let mut entry = |id: i8, name: &str, content: &[u8]| {
        parameters.extend([name.len() as u8, id.cast_unsigned()]);
        parameters.extend(name.as_bytes());
        parameters.extend((content.len() as u16 + 2).to_le_bytes());
        parameters.extend(content);
    };
    entry(-1, "POINT", &[0]);
    entry(1, "UNITS", b"\xff\x02\x02\x01mm\0");
    let mut labels = vec![0xff, 2, 2, cells as u8];
    labels.extend((1..=cells).flat_map(|cell| format!("c{cell}").into_bytes()));
    labels.push(0);
    entry(1, "LABELS", &labels);
    let used = [&[2, 0][..], &(cells as u16).to_le_bytes(), &[0]].concat();
    entry(1, "USED", &used);
    parameters.resize(BLOCK, 0);
    let mut data = Vec::new();
    for sample in 0..frames {
        for series in &recording.position_m {
            for part in [series[sample] * 1e3, 2.5, 30.0, 0.0] {
                if in_integers {
                    data.extend(((part / f64::from(scale)).round() as i16).to_le_bytes());
                } else {
                    data.extend((part as f32).to_le_bytes());
                }
            }
        }
    }
    data.resize(data.len().next_multiple_of(BLOCK), 0);
    [header, parameters, data].concat()
}

/// How a log holds its messages.
#[derive(Clone, Copy)]
enum Encoding {
    Json,
    Protobuf,
}

impl Encoding {
    fn name(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Protobuf => "protobuf",
        }
    }

    fn of<T: Logged>(self, message: &T) -> Vec<u8> {
        let mut bytes = Vec::new();
        match self {
            Self::Json => message.write_json(&mut bytes).expect("a vector takes all"),
            Self::Protobuf => message.write_protobuf(&mut bytes),
        }
        bytes
    }
}

/// A command with a value in every field.
fn refused_crawl() -> CommandRecord {
    let command = Command {
        cycles_per_s: -0.5,
        limit_s: 1.5,
        alarm_mask: 6,
        user: 1000,
        sender: ShortText::new("änn"),
        ..Command::new(CommandKind::Crawl)
    };
    let reply = Reply {
        sequence: 7,
        verdict: CommandOutcome::AlarmStands.code(),
        mode: Mode::Armed.code(),
        fault: 1,
        alarm_mask: 4,
    };
    CommandRecord::new(3, (1_000_000_001, 2.5), true, &command, &reply)
}

/// A message with the byte before it that names its type to the target.
fn protobuf<T: ProtobufMessage>(of_type: u8, message: &T) -> Vec<u8> {
    let mut bytes = vec![of_type];
    message.write_protobuf(&mut bytes);
    bytes
}

/// A short log as a recorder writes it.
fn compressed_log(telemetry: &Telemetry) -> Vec<u8> {
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), Path::new("worm.mcap"), &origin()).expect("memory takes all");
    for (state, timing) in telemetry.states.iter().zip(&telemetry.timings) {
        writer.write(state).expect("memory takes all");
        writer.write(timing).expect("memory takes all");
    }
    writer.write(&telemetry.estimates[0]).expect("memory takes all");
    writer.finish().expect("memory takes all");
    sink.bytes()
}

/// A log without compression and schemas, so that a fuzzer reaches its messages: some as records of their own, some in a chunk without a
/// checksum.
fn log(telemetry: &Telemetry, encoding: Encoding) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let record = |opcode: u8, parts: &[&[u8]]| {
        let content = parts.concat();
        [&[opcode][..], &(content.len() as u64).to_le_bytes(), &content].concat()
    };
    let message = |channel: Channel, sequence: u32, content: &[u8]| {
        let head = [
            &(channel as u16 + 1).to_le_bytes()[..],
            &sequence.to_le_bytes(),
            &[0; 16],
        ];
        record(0x05, &[&head.concat(), content])
    };
    let mut bytes = [MAGIC, &record(0x01, &[&text(""), &text("")])].concat();
    for &channel in Channel::ALL {
        let id = (channel as u16 + 1).to_le_bytes();
        bytes.extend(record(0x03, &[&id, &text(channel.type_name()), &text(""), &text("")]));
        bytes.extend(record(
            0x04,
            &[&id, &id, &text(&channel.topic()), &text(encoding.name()), &text("")],
        ));
    }
    fn records<T: Logged>(
        messages: &[T],
        encoding: Encoding,
        record: impl Fn(Channel, u32, &[u8]) -> Vec<u8>,
    ) -> Vec<u8> {
        let numbered = (0..).zip(messages);
        numbered
            .flat_map(|(sequence, message)| record(T::CHANNEL, sequence, &encoding.of(message)))
            .collect()
    }
    bytes.extend(records(&telemetry.states[..4], encoding, message));
    let later = records(&telemetry.states[4..6], encoding, message);
    let estimates = records(&telemetry.estimates[..1], encoding, message);
    let length = ((later.len() + estimates.len()) as u64).to_le_bytes();
    bytes.extend(record(
        0x06,
        &[&[0; 16], &length, &[0; 4], &text(""), &length, &later, &estimates],
    ));
    bytes.extend(record(0x0F, &[&[0; 4]]));
    bytes.extend(record(0x02, &[&[0; 20]]));
    bytes.extend(MAGIC);
    bytes
}

fn lines<T: JsonMessage>(messages: &[T]) -> Vec<u8> {
    let mut text = Vec::new();
    for message in messages {
        message.write_json(&mut text).expect("a vector takes all");
        text.push(b'\n');
    }
    text
}

fn messages(telemetry: &Telemetry) -> Vec<u8> {
    let of_states = lines(&telemetry.states[..6]);
    [
        of_states,
        lines(&telemetry.timings[..1]),
        lines(&telemetry.estimates[..2]),
    ]
    .concat()
}
