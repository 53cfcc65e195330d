//! The table of faults: grammar, help text and effect of each in one row. A new fault is a new row.

use super::conditions::Conditions;
use std::fmt::Write as _;
use worm_physics::MAX_CELLS;

/// Friction inside at which nothing turns: 0.05 N m becomes 5 kN m.
pub(super) const BLOCKED: f64 = 1e5;

/// What a parameter may be.
pub(super) enum Domain {
    /// A number from, to, with its unit.
    Number(f64, f64, &'static str),
    /// A cell from 1; `all` where there is a default.
    Cell,
    /// One of these words; its value is its index.
    Word(&'static [&'static str]),
    /// A bit mask or a number of this many bits, decimal or `0x…`.
    Integer(u32),
}

/// A parameter of a fault.
pub(super) struct Parameter {
    pub(super) name: &'static str,
    pub(super) domain: Domain,
    pub(super) default: Option<f64>,
}

/// One kind of fault.
pub(super) struct FaultKind {
    pub(super) name: &'static str,
    pub(super) meaning: &'static str,
    pub(super) parameters: &'static [Parameter],
    /// Index of the parameter that says how many seconds the fault lasts, for one that ends by itself.
    pub(super) lasts: Option<usize>,
    pub(super) apply: fn(&mut Conditions, &[f64]),
}

const fn number(name: &'static str, from: f64, to: f64, unit: &'static str, default: Option<f64>) -> Parameter {
    Parameter {
        name,
        domain: Domain::Number(from, to, unit),
        default,
    }
}

const fn fraction(default: Option<f64>) -> Parameter {
    number("share", 0.0, 1.0, "", default)
}

/// All cells.
const ALL_CELLS: f64 = 0.0;

const CELL: Parameter = Parameter {
    name: "cell",
    domain: Domain::Cell,
    default: None,
};

const ANY_CELL: Parameter = Parameter {
    name: "cell",
    domain: Domain::Cell,
    default: Some(ALL_CELLS),
};

const DEVICES: &[&str] = &["servo", "tracker"];

/// The cells that a parameter names.
fn cells(value: f64) -> std::ops::Range<usize> {
    if value == ALL_CELLS {
        0..MAX_CELLS
    } else {
        value as usize - 1..value as usize
    }
}

const fn kind(
    name: &'static str,
    meaning: &'static str,
    parameters: &'static [Parameter],
    apply: fn(&mut Conditions, &[f64]),
) -> FaultKind {
    FaultKind {
        name,
        meaning,
        parameters,
        lasts: None,
        apply,
    }
}

/// Every kind of fault.
pub(super) const KINDS: &[FaultKind] = &[
    kind("stall", "the cam is blocked hard", &[], |c, _| {
        c.plant.inner_friction_scale = BLOCKED;
    }),
    kind(
        "jam",
        "a cell extends by no more than this share of its stroke",
        &[CELL, fraction(Some(0.0))],
        |c, v| {
            for cell in cells(v[0]) {
                c.plant.stroke_scale[cell] = v[1];
            }
        },
    ),
    kind(
        "slip",
        "the tips hold with this share of their friction",
        &[number("friction", 0.0, 10.0, "", Some(0.3)), ANY_CELL],
        |c, v| {
            for cell in cells(v[1]) {
                c.plant.friction_scale[cell] *= v[0];
            }
        },
    ),
    kind(
        "slide",
        "the worm slips down the canal at this speed, tips and all, while it crawls",
        &[number("speed", 0.0, 0.1, "m/s", Some(0.002))],
        |c, v| c.plant.drag_speed_m_per_s = v[0],
    ),
    kind(
        "slope",
        "the canal has this slope",
        &[number("deg", -90.0, 90.0, "degrees", Some(45.0))],
        |c, v| c.plant.slope_deg = Some(v[0]),
    ),
    kind(
        "drag",
        "a force holds the worm back",
        &[number("force", -50.0, 50.0, "N", Some(0.5))],
        |c, v| c.plant.drag_n += v[0],
    ),
    kind(
        "friction-inside",
        "friction inside is so many times the usual",
        &[number("scale", 0.0, 1000.0, "", Some(3.0))],
        |c, v| c.plant.inner_friction_scale *= v[0],
    ),
    kind(
        "battery",
        "the battery has this share of its charge when the fault begins; needs a [battery] in the configuration",
        &[number("charge", 0.0, 1.0, "", Some(0.1))],
        |c, v| c.plant.battery_charge = Some(v[0]),
    ),
    kind(
        "sag",
        "the supply lacks volts and gains resistance",
        &[
            number("volts", 0.0, 60.0, "V", Some(1.5)),
            number("ohm", 0.0, 100.0, "ohm", Some(0.0)),
        ],
        |c, v| {
            c.plant.supply_drop_v = v[0];
            c.plant.supply_extra_ohm = v[1];
        },
    ),
    kind(
        "silence",
        "a device neither receives nor answers",
        &[Parameter {
            name: "device",
            domain: Domain::Word(DEVICES),
            default: None,
        }],
        |c, v| {
            if v[0] == 0.0 {
                c.wire.servo_silent = true;
            } else {
                c.wire.tracker_silent = true;
            }
        },
    ),
    kind(
        "drop",
        "a share of the answers is lost",
        &[fraction(Some(0.05))],
        |c, v| {
            c.wire.drop_fraction = v[0];
        },
    ),
    kind(
        "corrupt",
        "a share of the answers has a flipped bit",
        &[fraction(Some(0.05))],
        |c, v| c.wire.corrupt_fraction = v[0],
    ),
    kind(
        "delay",
        "answers come later",
        &[number("ms", 0.0, 10_000.0, "ms", Some(2.0))],
        |c, v| c.wire.delay_s = v[0] * 1e-3,
    ),
    FaultKind {
        name: "reboot",
        meaning: "the servo loses power for this long, and with it torque, watchdog and goal",
        parameters: &[number("off", 0.0, 60.0, "s", Some(0.05))],
        lasts: Some(0),
        apply: |c, _| c.servo.unpowered = true,
    },
    kind(
        "overheat",
        "the servo is heated from outside",
        &[number("ambient", -40.0, 150.0, "degrees C", Some(90.0))],
        |c, v| c.plant.heated_to_c = Some(v[0]),
    ),
    kind(
        "hardware-error",
        "the servo finds hardware errors (register 70), 0x20 is overload",
        &[Parameter {
            name: "bits",
            domain: Domain::Integer(8),
            default: Some(32.0),
        }],
        |c, v| c.servo.hardware_errors |= v[0] as u8,
    ),
    kind("blind", "the tracker does not see a cell", &[CELL], |c, v| {
        for cell in cells(v[0]) {
            c.camera.hidden |= 1 << cell;
        }
    }),
    kind(
        "dropout",
        "the tracker misses a share of the positions",
        &[fraction(Some(0.3))],
        |c, v| c.camera.dropout_share = Some(v[0]),
    ),
    kind(
        "noise",
        "the tracker's positions have this standard deviation",
        &[number("m", 0.0, 0.1, "m", Some(0.0003))],
        |c, v| c.camera.noise_m = Some(v[0]),
    ),
    kind(
        "wrong-model",
        "the servo says that it is another model",
        &[Parameter {
            name: "number",
            domain: Domain::Integer(16),
            default: Some(1190.0),
        }],
        |c, v| c.servo.model_number = Some(v[0] as u16),
    ),
    kind(
        "emergency-stop",
        "switches of the tracker are pressed (register 127)",
        &[Parameter {
            name: "bits",
            domain: Domain::Integer(8),
            default: Some(1.0),
        }],
        |c, v| c.switches |= v[0] as u8,
    ),
    kind(
        "watchdog-defect",
        "the servo's bus watchdog latches without stopping the motor, as with this firmware",
        &[Parameter {
            name: "firmware",
            domain: Domain::Integer(8),
            default: Some(51.0),
        }],
        |c, v| {
            c.servo.watchdog_defect = true;
            c.servo.firmware = Some(v[0] as u8);
        },
    ),
];

impl FaultKind {
    /// As one would write it with its defaults.
    pub(super) fn usage(&self) -> String {
        let mut usage = self.name.to_owned();
        for (index, parameter) in self.parameters.iter().enumerate() {
            let separator = if index == 0 { ':' } else { ',' };
            let example = match (&parameter.domain, parameter.default) {
                (Domain::Cell, Some(_)) => "all".to_owned(),
                (Domain::Cell, None) => "2".to_owned(),
                (Domain::Word(words), _) => words.join("|"),
                (_, default) => default.unwrap_or(0.0).to_string(),
            };
            let _infallible = write!(usage, "{separator}{}={example}", parameter.name);
        }
        usage
    }

    pub(super) fn known_parameters(&self) -> String {
        if self.parameters.is_empty() {
            return "it has none".to_owned();
        }
        let list: Vec<String> = self
            .parameters
            .iter()
            .map(|parameter| format!("{}: {}", parameter.name, parameter.domain))
            .collect();
        format!("it has {}", list.join("; "))
    }
}

impl std::fmt::Display for Domain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(from, to, "") => write!(f, "from {from} to {to}"),
            Self::Number(from, to, unit) => write!(f, "from {from} to {to} {unit}"),
            Self::Cell => write!(f, "a cell from 1 to {MAX_CELLS}, or \"all\""),
            Self::Word(words) => write!(f, "one of {}", words.join(", ")),
            Self::Integer(bits) => write!(f, "a number of {bits} bits, decimal or 0x..."),
        }
    }
}

impl Domain {
    /// A value as it is written.
    pub(super) fn text(&self, value: f64) -> String {
        match self {
            Self::Cell if value == ALL_CELLS => "all".to_owned(),
            Self::Word(words) => words.get(value as usize).copied().unwrap_or_default().to_owned(),
            Self::Number(..) | Self::Cell | Self::Integer(_) => value.to_string(),
        }
    }

    pub(super) fn parse(&self, text: &str) -> Option<f64> {
        match self {
            &Self::Number(from, to, _) => text.parse().ok().filter(|value| (from..=to).contains(value)),
            Self::Cell if text == "all" => Some(ALL_CELLS),
            Self::Cell => text
                .parse::<u8>()
                .ok()
                .filter(|&cell| (1..=MAX_CELLS).contains(&usize::from(cell)))
                .map(f64::from),
            Self::Word(words) => words.iter().position(|&word| word == text).map(|index| index as f64),
            &Self::Integer(bits) => {
                let value = match text.strip_prefix("0x") {
                    Some(digits) => u32::from_str_radix(digits, 16).ok(),
                    None => text.parse().ok(),
                };
                value.filter(|value| value >> bits == 0).map(f64::from)
            }
        }
    }
}
