//! `wormd topics`: the services of a worm and the messages on them, for programs in other languages.

mod c_header;
mod describe;

use super::{Failure, print};
use crate::topics::describe_topics;
use clap::Args;
use describe::{Described, Structure};

/// Arguments of `wormd topics`.
#[derive(Debug, Args)]
pub struct TopicsArgs {
    /// The fields of this topic's message; without it, all topics
    #[arg(value_name = "TOPIC", conflicts_with_all = ["json", "c_header"])]
    topic: Option<String>,
    /// Print one JSON object with all topics, fields and enumerations
    #[arg(long)]
    json: bool,
    /// Print a header for C and C++ with all messages
    #[arg(long, conflicts_with = "json")]
    c_header: bool,
}

/// Runs `wormd topics`. Needs no worm.
///
/// # Errors
/// [`Failure::Unusable`] for a topic that there is not, [`Failure::Failed`] when nothing can be printed.
pub fn run(args: &TopicsArgs) -> Result<(), Failure> {
    let described = Described::new();
    if args.json {
        return print::line(serde_json::to_string(&described).map_err(Failure::failed)?);
    }
    if args.c_header {
        return print::line(c_header::of(&described).trim_end());
    }
    let Some(name) = &args.topic else {
        return print::line(list(&described).trim_end());
    };
    let structures: Vec<_> = described.structures_of(name).collect();
    if structures.is_empty() {
        let names: Vec<_> = describe_topics().iter().map(|topic| topic.name).collect();
        return Err(Failure::unusable(format!(
            "there is no topic {name}: give one of {}",
            names.join(", ")
        )));
    }
    let texts: Vec<_> = structures.into_iter().map(fields).collect();
    print::line(texts.join("\n").trim_end())
}

/// One line for each topic.
fn list(described: &Described) -> String {
    let mut text = format!(
        "{:<10} {:<24} {:>5}  {:>6}  {:>7}  event\n",
        "topic", "type", "bytes", "buffer", "history"
    );
    for topic in &described.topics {
        text += &format!(
            "{:<10} {:<24} {:>5}  {:>6}  {:>7}  {}\n",
            topic.name,
            topic.message.type_name,
            topic.message.size,
            topic.buffer,
            topic.history,
            if topic.event { "yes" } else { "" },
        );
    }
    let [request, response] = [&described.command.request, &described.command.response];
    text += &format!(
        "{:<10} {} -> {}, request and response\n\nServices are worm/NAME/TOPIC. `wormd topics TOPIC` lists the fields of a message.\n",
        "command", request.type_name, response.type_name
    );
    text
}

/// One line for each field.
fn fields(structure: &Structure) -> String {
    let mut text = format!(
        "{}, {} bytes: {}\n",
        structure.type_name, structure.size, structure.documentation
    );
    for field in &structure.fields {
        text += &format!(
            "{:>5}  {:<8} {}: {}\n",
            field.offset,
            field.type_in_words(),
            field.name,
            field.documentation
        );
    }
    text
}
