//! The topics and their messages as data: what `wormd topics --json` prints. Its members are a contract.

use crate::topics::{TopicDescription, describe_topics};
use serde::Serialize;
use worm_estimator::message::{Codes, Command, Field, FieldKind, InMemory, Layout, Reply, prose};
use worm_physics::MAX_CELLS;

/// Everything.
#[derive(Debug, Serialize)]
pub(super) struct Described {
    /// Version of this `wormd`.
    pub version: &'static str,
    /// How many places arrays over cells have.
    pub max_cells: usize,
    /// Publish-subscribe services `worm/<worm>/<name>`.
    pub topics: Vec<DescribedTopic>,
    /// The request-response service `worm/<worm>/command`.
    pub command: DescribedService,
    /// The enumerations of all messages.
    pub enumerations: Vec<Enumeration>,
}

/// A publish-subscribe service.
#[derive(Debug, Serialize)]
pub(super) struct DescribedTopic {
    pub name: &'static str,
    /// Samples that a subscriber can fall behind before it loses the oldest.
    pub buffer: usize,
    /// Last samples that a late joiner gets.
    pub history: usize,
    /// Whether an event service of the same name wakes its listeners.
    pub event: bool,
    /// The field with the number of the sample, which grows by one with each.
    pub number_field: Option<&'static str>,
    pub message: Structure,
}

/// A request-response service.
#[derive(Debug, Serialize)]
pub(super) struct DescribedService {
    pub request: Structure,
    pub response: Structure,
}

/// A structure in shared memory.
#[derive(Debug, Serialize)]
pub(super) struct Structure {
    /// Its name, as `State`.
    pub name: &'static str,
    /// Its name and version on the service.
    #[serde(rename = "type")]
    pub type_name: &'static str,
    /// Bytes.
    pub size: usize,
    /// Bytes.
    pub alignment: usize,
    pub documentation: String,
    pub fields: Vec<DescribedField>,
}

/// A field of a structure.
#[derive(Debug, Serialize)]
pub(super) struct DescribedField {
    pub name: &'static str,
    /// `f64`, `u64`, `u32`, `i32` or, for a text, `u8`.
    #[serde(rename = "type")]
    pub type_name: &'static str,
    /// How many of them; none where it is no array.
    pub count: Option<usize>,
    /// Bytes from the beginning of the structure.
    pub offset: usize,
    /// Bytes.
    pub size: usize,
    /// What it holds: `number`, `per-cell`, `count`, `code` or `text`.
    pub holds: &'static str,
    /// The enumeration of a code.
    pub enumeration: Option<&'static str>,
    /// Whether `u32::MAX` stands for "none".
    pub optional: bool,
    /// Meaning and unit.
    pub documentation: String,
}

/// An enumeration that crosses topics as a code.
#[derive(Debug, Serialize)]
pub(super) struct Enumeration {
    pub name: &'static str,
    pub documentation: String,
    pub values: Vec<DescribedValue>,
}

/// A value of an enumeration.
#[derive(Debug, Serialize)]
pub(super) struct DescribedValue {
    pub code: u32,
    /// As in JSON and logs.
    pub name: &'static str,
    pub documentation: String,
}

impl Described {
    pub(super) fn new() -> Self {
        let topics = describe_topics();
        let (request, response) = (Command::LAYOUT, Reply::LAYOUT);
        let mut enumerations: Vec<Enumeration> = Vec::new();
        let layouts = topics.iter().map(|topic| topic.layout).chain([request, response]);
        for field in layouts.flat_map(|layout| layout.fields) {
            if let FieldKind::Code(codes) = field.kind
                && enumerations.iter().all(|known| known.name != codes.name)
            {
                enumerations.push(Enumeration::of(codes));
            }
        }
        Self {
            version: env!("CARGO_PKG_VERSION"),
            max_cells: MAX_CELLS,
            topics: topics.iter().map(DescribedTopic::of).collect(),
            command: DescribedService {
                request: Structure::of(&request),
                response: Structure::of(&response),
            },
            enumerations,
        }
    }

    /// All structures, those of the topics first.
    pub(super) fn structures(&self) -> impl Iterator<Item = &Structure> {
        let service = [&self.command.request, &self.command.response];
        self.topics.iter().map(|topic| &topic.message).chain(service)
    }

    /// The structures that travel on services of this name.
    pub(super) fn structures_of(&self, name: &str) -> impl Iterator<Item = &Structure> {
        let topics = self.topics.iter().filter(move |topic| topic.name == name);
        let service = [&self.command.request, &self.command.response];
        let is_command = name == "command";
        topics
            .map(|topic| &topic.message)
            .chain(service.into_iter().filter(move |_| is_command))
    }
}

impl DescribedTopic {
    fn of(topic: &TopicDescription) -> Self {
        Self {
            name: topic.name,
            buffer: topic.buffer,
            history: topic.history,
            event: topic.is_announced,
            number_field: topic.number_field,
            message: Structure::of(&topic.layout),
        }
    }
}

impl Structure {
    fn of(layout: &Layout) -> Self {
        Self {
            name: layout.name,
            type_name: layout.type_name,
            size: layout.size,
            alignment: layout.alignment,
            documentation: prose(layout.documentation),
            fields: layout.fields.iter().map(DescribedField::of).collect(),
        }
    }
}

impl DescribedField {
    fn of(field: &Field) -> Self {
        let (type_name, holds) = match field.kind {
            FieldKind::Number => ("f64", "number"),
            FieldKind::PerCell => ("f64", "per-cell"),
            FieldKind::U64 => ("u64", "count"),
            FieldKind::U32 => ("u32", "count"),
            FieldKind::I32 => ("i32", "count"),
            FieldKind::Code(_) => ("u32", "code"),
            FieldKind::Text => ("u8", "text"),
        };
        let of_one = match type_name {
            "f64" | "u64" => 8,
            "u8" => 1,
            _ => 4,
        };
        Self {
            name: field.name,
            type_name,
            count: (field.size != of_one).then_some(field.size / of_one),
            offset: field.offset,
            size: field.size,
            holds,
            enumeration: match field.kind {
                FieldKind::Code(codes) => Some(codes.name),
                _ => None,
            },
            optional: field.is_optional,
            documentation: field.description(),
        }
    }

    /// As `f64[16]`.
    pub(super) fn type_in_words(&self) -> String {
        match self.count {
            Some(count) => format!("{}[{count}]", self.type_name),
            None => self.type_name.to_owned(),
        }
    }
}

impl Enumeration {
    fn of(codes: &Codes) -> Self {
        let values = codes.values.iter().map(|value| DescribedValue {
            code: value.code,
            name: value.name,
            documentation: prose(value.documentation),
        });
        Self {
            name: codes.name,
            documentation: prose(codes.documentation),
            values: values.collect(),
        }
    }
}
