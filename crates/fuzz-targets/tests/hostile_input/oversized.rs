//! Inputs that are long or deep, which no mutation of a small one becomes: whatever takes time or memory that grows faster than the
//! input shows on them.

use std::path::Path;
use testkit::log_sample::{ORIGIN_CONFIG, Sink, crawl, origin};
use worm_estimator::config::Config;
use worm_estimator::message::{Estimate, FieldAccess};
use worm_log::Writer;

/// Bytes of a long input.
const LONG: usize = 1 << 20;

/// Inputs for a target, each with a name.
pub fn inputs(target: &str) -> Vec<(&'static str, Vec<u8>)> {
    match target {
        "packets" => vec![
            ("headers without end", long(b"\xff\xff\xfd\x00")),
            (
                "packets that claim to be long",
                long(b"\xff\xff\xfd\x00\x01\xf9\x01\x55"),
            ),
        ],
        "tracker_table" => vec![("empty pieces", long(&[1, 0, 2, 0, 0, 0]))],
        "config_toml" => [toml_attacks(), config_attacks()].concat(),
        "campaign_toml" => [toml_attacks(), campaign_attacks()].concat(),
        "recording_csv" => csv_attacks(),
        "route_csv" => route_attacks(),
        "vicon_csv" => vicon_attacks(),
        "c3d" => c3d_attacks(),
        "mcap_log" => mcap_attacks(),
        "log_messages" => message_attacks(),
        "protobuf_message" => protobuf_attacks(),
        _ => Vec::new(),
    }
}

fn long(piece: &[u8]) -> Vec<u8> {
    piece.repeat(LONG / piece.len())
}

fn text(parts: &[&str]) -> Vec<u8> {
    parts.concat().into_bytes()
}

/// A list of numbered pieces.
fn numbered(count: usize, piece: impl Fn(usize) -> String) -> String {
    (1..=count).map(piece).collect()
}

fn toml_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let deep = |piece: &str, length: usize| piece.repeat(length / piece.len());
    vec![
        ("nested lists", text(&["a = ", &deep("[", LONG)])),
        ("nested tables", text(&["a = ", &deep("{a=", LONG)])),
        ("a long dotted key", text(&[&deep("a.", LONG / 8), "a = 1"])),
        ("a long dotted header", text(&["[", &deep("a.", LONG / 8), "a]"])),
        ("brackets", text(&[&deep("[[a]]\n", LONG)])),
        (
            "many keys",
            text(&[&numbered(50_000, |number| format!("key{number} = 1\n"))]),
        ),
        ("a long number", text(&["a = ", &deep("1", LONG)])),
        ("a long key", text(&[&deep("k", LONG), " = 1"])),
        ("a long text", text(&["a = \"", &deep("x", LONG), "\""])),
        ("blank lines", long(b"\n")),
    ]
}

fn config_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let list = "0,".repeat(100_000);
    vec![
        ("every key", Config::COMMENTED.into()),
        (
            "a value for each of many cells",
            text(&["[worm]\nstiffness_n_per_m = [", &list, "]"]),
        ),
        ("a long step order", text(&["[worm]\nstep_order = [", &list, "]"])),
        ("a long name", text(&["[worm]\nname = \"", &"x".repeat(LONG), "\""])),
        ("a long root", text(&["[topics]\nroot = \"/", &"x".repeat(LONG), "\""])),
        ("many wrong effects", "[[effect]]\nname=\"\"\n".repeat(20_000).into()),
        (
            "many effects",
            "[[effect]]\nname=\"constant-drag\"\nforce_n=0.2\n"
                .repeat(10_000)
                .into(),
        ),
        (
            "an effect with a long name",
            text(&["[[effect]]\nname=\"", &"x".repeat(LONG / 4), "\""]),
        ),
        (
            "an effect with many parameters",
            text(&[
                "[[effect]]\nname=\"payload\"\n",
                &numbered(20_000, |number| format!("p{number}=1.0\n")),
            ]),
        ),
        (
            "not a number",
            b"[canal]\nslope_deg = nan\n[[effect]]\nname=\"constant-drag\"\nforce_n=nan\n".into(),
        ),
    ]
}

fn campaign_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let run = "[[run]]\nslope_deg=1\nadvance_m=0.001\nadvance_sigma_m=0.001\n";
    vec![
        ("many runs", run.repeat(10_000).into()),
        (
            "a device as the worm",
            b"worm = \"/dev/zero\"\n[[run]]\nslope_deg=1\nadvance_m=0\nadvance_sigma_m=1e-3".into(),
        ),
        (
            "a long path",
            text(&["[[run]]\nslope_deg=1\nrecording=\"", &"x/".repeat(LONG / 2), "\""]),
        ),
    ]
}

fn route_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let head = "length_m,slope_deg\n";
    vec![
        ("many legs", text(&[head, &"1,0\n".repeat(LONG / 4)])),
        ("many columns", text(&["length_m,slope_deg", &",x".repeat(LONG / 2)])),
        ("a long column", long(b"column")),
        ("a long number", text(&[head, &"1".repeat(LONG), ",0\n"])),
        ("an open quote", text(&[head, "\"", &"1,0\n".repeat(LONG / 4)])),
    ]
}

fn csv_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let rows = |row: &dyn Fn(usize) -> String| numbered(40_000, row);
    let head = "time_s,x1_m,x2_m\n";
    vec![
        (
            "many unknown columns",
            text(&["time_s,x1_m,x2_m", &",".repeat(LONG), "\n"]),
        ),
        (
            "many named unknown columns",
            text(&[
                "time_s,x1_m,x2_m",
                &numbered(80_000, |number| format!(",column{number}")),
                "\n",
            ]),
        ),
        (
            "many cells",
            text(&["time_s", &numbered(80_000, |number| format!(",x{number}_m")), "\n"]),
        ),
        (
            "columns given twice",
            text(&["time_s", &",x1_m".repeat(LONG / 5), "\n"]),
        ),
        ("a long name", text(&["time_s,x1_m,x2_m,", &"é".repeat(LONG / 2), "\n"])),
        ("an open quote", text(&[head, "0,\"", &"1,2\n".repeat(LONG / 4)])),
        ("a row of commas", text(&[head, &",".repeat(LONG)])),
        ("rows of commas", text(&[head, &",,\n".repeat(LONG / 3)])),
        ("comments", text(&[&"#\n".repeat(LONG / 2)])),
        ("carriage returns", text(&[head, &"\r".repeat(LONG)])),
        ("nothing seen", text(&[head, &rows(&|row| format!("{row},,\n"))])),
        (
            "huge positions",
            text(&[
                head,
                &rows(&|row| format!("{row},1e308,{}1e308\n", if row % 2 == 0 { "-" } else { "" })),
            ]),
        ),
        (
            "huge times",
            text(&[head, &rows(&|row| format!("{row}e300,{row},{row}.1\n"))]),
        ),
        (
            "gaps everywhere",
            text(&[
                head,
                &rows(&|row| {
                    if row % 2 == 0 {
                        format!("{row},,\n")
                    } else {
                        format!("{row},{row}e-5,0\n")
                    }
                }),
            ]),
        ),
        (
            "one motor column",
            text(&[
                "time_s,x1_m,x2_m,bus_voltage_v\n",
                &rows(&|row| format!("{row},{row}e-5,0,\n")),
            ]),
        ),
    ]
}

fn vicon_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let table = |markers: usize, row: &dyn Fn(usize) -> String| {
        let names = numbered(markers, |marker| format!("m{marker},,,"));
        let (axes, units) = (",X,Y,Z".repeat(markers), ",mm".repeat(3 * markers));
        let rows = numbered(LONG / (6 * markers), row);
        text(&[
            "Trajectories\n100\n,,",
            &names,
            "\nFrame,Sub Frame",
            &axes,
            "\n,",
            &units,
            "\n",
            &rows,
        ])
    };
    vec![
        ("a line without end", long(b"Trajectories,")),
        ("blank lines", text(&["Devices\n", &"\n".repeat(LONG)])),
        (
            "many markers",
            table(50_000, &|row| format!("{row},0{}\n", ",1".repeat(150_000))),
        ),
        (
            "many markers that crawl",
            table(2_000, &|row| {
                format!("{row},0{}\n", format!(",{row},2,3").repeat(2_000))
            }),
        ),
        (
            "a long name",
            text(&[
                "Trajectories\n100\n,,",
                &"n".repeat(LONG / 2),
                "\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n",
            ]),
        ),
        ("nothing seen", table(3, &|row| format!("{row},0,,,,,,,,,\n"))),
        (
            "huge positions",
            table(3, &|row| {
                format!("{row},0,{row}e300,1e308,-1e308,{row}e299,0,0,1,2,3\n")
            }),
        ),
        (
            "one huge position",
            table(3, &|row| {
                format!(
                    "{row},0,{row},1,{},{row},0,0,{row},2,3\n",
                    if row == 50 { "1e200" } else { "0" }
                )
            }),
        ),
        (
            "frames far apart",
            table(3, &|row| format!("{}000000000,0,{row},1,1,{row},0,0,{row},2,3\n", row)),
        ),
    ]
}

/// A header and a parameter section of a C3D file, with the parameters given.
fn c3d(points: u16, frames: u16, parameters: &[u8], data: &[u8]) -> Vec<u8> {
    let mut file = vec![2, 0x50];
    for word in [points, 0, 1, frames, 0] {
        file.extend(word.to_le_bytes());
    }
    file.extend((-1.0f32).to_le_bytes());
    let data_block = 2 + (parameters.len() + 4).div_ceil(512) as u16;
    file.extend(data_block.to_le_bytes());
    file.extend([0, 0]);
    file.extend(100f32.to_le_bytes());
    file.resize(512, 0);
    file.extend([1, 0x50, 1, 84]);
    file.extend(parameters);
    file.resize(512 * (usize::from(data_block) - 1), 0);
    file.extend(data);
    file
}

fn c3d_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let group = b"\x05\xffPOINT\x03\x00\x00";
    let units = b"\x05\x01UNITS\x07\x00\xff\x01\x02mm";
    // A name of three bytes, then the greatest number of dimensions: the next parameters lie in them, with a 0 that makes them empty.
    let many_dimensions: Vec<u8> = (0..27_000u32)
        .flat_map(|number| {
            let [a, b, c] = [number, number / 32, number / 1024].map(|digit| b'A' + (digit % 32) as u8);
            [3, 1, a, b, c, 4, 0, 1, 255]
        })
        .chain([0; 512])
        .collect();
    let mut labels = [group.as_slice(), units].concat();
    labels.extend(b"\x06\x01LABELS\x00\x00\xff\x03\x01\xff\xff");
    labels.extend(vec![b'x'; 255 * 255]);
    vec![
        (
            "many dimensions",
            c3d(1, 1, &[group.as_slice(), units, &many_dimensions].concat(), &[0; 4096]),
        ),
        (
            "many short labels",
            c3d(65_535, 1, &labels, &vec![0; 16 * 65_535 + 512]),
        ),
        (
            "nothing but points",
            c3d(
                65_535,
                1,
                &[group.as_slice(), units].concat(),
                &vec![1; 16 * 65_535 + 512],
            ),
        ),
        (
            "nothing but frames",
            c3d(
                1,
                65_535,
                &[group.as_slice(), units].concat(),
                &vec![1; 16 * 65_535 + 512],
            ),
        ),
    ]
}

fn mcap_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let telemetry = crawl(0.5);
    let sink = Sink::default();
    let mut writer = Writer::new(sink.clone(), Path::new("worm.mcap"), &origin()).expect("memory takes all");
    for state in &telemetry.states {
        writer.write(state).expect("memory takes all");
    }
    for estimate in &telemetry.estimates {
        writer.write(estimate).expect("memory takes all");
    }
    writer.finish().expect("memory takes all");
    let whole = sink.bytes();
    let magic = &whole[..8];
    let record = |opcode: u8, length: u64, content: &[u8]| [&[opcode][..], &length.to_le_bytes(), content].concat();
    // A chunk: times, unpacked size, checksum, compression, packed size.
    let chunk = |unpacked: u64, compression: &str, packed: &[u8]| {
        let mut content = vec![0; 16];
        content.extend(unpacked.to_le_bytes());
        content.extend(7u32.to_le_bytes());
        content.extend((compression.len() as u32).to_le_bytes());
        content.extend(compression.as_bytes());
        content.extend((packed.len() as u64).to_le_bytes());
        content.extend(packed);
        record(6, content.len() as u64, &content)
    };
    let channels = |count: u16| {
        (0..count).flat_map(|id| {
            let mut content = id.to_le_bytes().to_vec();
            content.extend([0, 0, 4, 0, 0, 0]);
            content.extend(b"/xyz");
            content.extend([0; 8]);
            record(4, content.len() as u64, &content)
        })
    };
    let after_magic = |bytes: Vec<u8>| [magic, &bytes].concat();
    let cut = whole.len() / 2;
    vec![
        ("a whole log", whole.clone()),
        ("a log cut off", whole[..cut].to_vec()),
        (
            "a record that claims to be long",
            after_magic(record(5, 200_000_000, b"{}")),
        ),
        (
            "a record that claims to be endless",
            after_magic(record(5, u64::MAX, b"{}")),
        ),
        (
            "a record that claims to be long in a cut log",
            [&whole[..cut], &record(5, 200_000_000, b"{}")].concat(),
        ),
        (
            "a chunk that claims to be long",
            after_magic(chunk(200_000_000, "lz4", &[4, 0x22, 0x4d, 0x18, 0x40, 0x40, 0xc0])),
        ),
        (
            "a chunk that claims to be long without compression",
            after_magic(chunk(200_000_000, "", b"\x05")),
        ),
        (
            "a chunk whose record is longer than it",
            after_magic(chunk(11, "", b"\x05\x20\0\0\0\0\0\0\0{}")),
        ),
        (
            "many damaged chunks",
            after_magic(chunk(11, "", b"\x05\x02\0\0\0\0\0\0\0{}").repeat(10_000)),
        ),
        ("a chunk that unpacks to far more than its size", {
            // Nothing but the same empty message, again and again: what zstd makes smallest.
            let sink = Sink::default();
            let mut writer = Writer::new(sink.clone(), Path::new("worm.mcap"), &origin()).expect("memory takes all");
            for _ in 0..300_000 {
                writer.write(&Estimate::empty()).expect("memory takes all");
            }
            writer.finish().expect("memory takes all");
            sink.bytes()
        }),
        ("the same, cut off", {
            let sink = Sink::default();
            let mut writer = Writer::new(sink.clone(), Path::new("worm.mcap"), &origin()).expect("memory takes all");
            let begin = sink.bytes().len();
            for _ in 0..30_000 {
                writer.write(&Estimate::empty()).expect("memory takes all");
            }
            writer.flush().expect("memory takes all");
            let bytes = sink.bytes();
            bytes[..begin + (bytes.len() - begin) / 3].to_vec()
        }),
        (
            "a chunk whose decoder is to reserve much",
            // A zstd frame with a window of 3.75 TB.
            after_magic(chunk(
                200_000_000,
                "zstd",
                &[0x28, 0xb5, 0x2f, 0xfd, 0x00, 0xff, 0x00, 0x00],
            )),
        ),
        ("many channels", after_magic(channels(u16::MAX).collect())),
        ("many empty records", after_magic(record(0x80, 0, b"").repeat(100_000))),
        ("a configuration of another version", {
            let config = ORIGIN_CONFIG.as_bytes();
            let at = whole
                .windows(config.len())
                .position(|window| window == config)
                .expect("it is in it");
            let mut changed = whole.clone();
            changed[at] = b'x';
            changed
        }),
    ]
}

fn message_attacks() -> Vec<(&'static str, Vec<u8>)> {
    let telemetry = crawl(0.2);
    let mut lines = Vec::new();
    // No sample at all: an estimator could have started anywhere.
    for (number, state) in (0..).zip(telemetry.states.iter().cycle().take(1_500)) {
        let mut state = *state;
        state.sequence = number;
        state.sample_is_new = u32::from(number == 1_499);
        worm_estimator::message::JsonMessage::write_json(&state, &mut lines).expect("a vector takes all");
        lines.push(b'\n');
    }
    let mut estimate = telemetry.estimates[0];
    (estimate.time_ns, estimate.state_sequence) = (telemetry.states[1_499 % telemetry.states.len()].time_ns, 1_499);
    worm_estimator::message::JsonMessage::write_json(&estimate, &mut lines).expect("a vector takes all");
    vec![
        ("an estimator that could have started anywhere", lines),
        ("nested lists", long(b"[")),
        ("nested objects", long(b"{\"a\":")),
        ("empty lines", long(b"\n")),
    ]
}

fn protobuf_attacks() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        (
            "a list that claims to be endless",
            [&[0, 0x6a][..], &[0xff; 9], &[1]].concat(),
        ),
        ("a number without an end", [&[0][..], &long(b"\xff")].concat()),
        ("a field again and again", [&[0][..], &long(b"\x08\x01")].concat()),
        ("a list again and again", [&[0][..], &long(b"\x6a\x00")].concat()),
    ]
}
