//! The messages as a header for C11 and C++17.

use super::describe::{Described, DescribedField, Enumeration, Structure};
use std::fmt::Write;

/// The header.
pub(super) fn of(described: &Described) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_all(&mut text, described);
    text
}

fn write_all(out: &mut String, described: &Described) -> std::fmt::Result {
    writeln!(
        out,
        "/* The messages on the topics of a worm, for C11 and C++17.\n\
         \x20*\n\
         \x20* Made by `wormd topics --c-header`, version {}; do not edit. docs/topics.md explains topics and rules.\n\
         \x20*\n\
         \x20* A service is worm/NAME/TOPIC; iceoryx2 compares the name, size and alignment of its type. Numbers that are not known\n\
         \x20* are NaN, and what may be missing is WORMD_NONE. Arrays over cells have WORMD_MAX_CELLS places, of which the first\n\
         \x20* cell_count are in use; cell 1 of the paper is index 0. Times are nanoseconds of CLOCK_MONOTONIC. */\n\
         #ifndef WORMD_H\n#define WORMD_H\n\n#include <assert.h>\n#include <stddef.h>\n#include <stdint.h>\n\n\
         #define WORMD_VERSION \"{}\"\n#define WORMD_MAX_CELLS {}\n#define WORMD_NONE UINT32_MAX",
        described.version, described.version, described.max_cells
    )?;
    for topic in &described.topics {
        let name = topic.name.to_uppercase();
        writeln!(
            out,
            "\n#define WORMD_{name}_TOPIC \"{}\"\n#define WORMD_{name}_TYPE \"{}\"\n#define WORMD_{name}_BUFFER {}\n\
             #define WORMD_{name}_HISTORY {}",
            topic.name, topic.message.type_name, topic.buffer, topic.history
        )?;
    }
    let service = &described.command;
    writeln!(
        out,
        "\n/* Request and response on the service worm/NAME/command. */\n#define WORMD_COMMAND_REQUEST_TYPE \"{}\"\n\
         #define WORMD_COMMAND_RESPONSE_TYPE \"{}\"",
        service.request.type_name, service.response.type_name
    )?;
    for enumeration in &described.enumerations {
        write_enumeration(out, enumeration)?;
    }
    for structure in described.structures() {
        write_structure(out, structure)?;
    }
    writeln!(out, "\n#endif")
}

fn write_enumeration(out: &mut String, enumeration: &Enumeration) -> std::fmt::Result {
    let name = snake_case(enumeration.name);
    write_comment(out, "", &enumeration.documentation)?;
    writeln!(out, "enum wormd_{name} {{")?;
    for value in &enumeration.values {
        write_comment(out, "  ", &value.documentation)?;
        writeln!(out, "  {} = {},", constant(&name, value.name), value.code)?;
    }
    writeln!(out, "}};\n")?;
    writeln!(
        out,
        "/* The name, as in logs; \"unknown\" for a code of a newer version. */\n\
         static inline const char *wormd_{name}_name(uint32_t code) {{\n  switch (code) {{"
    )?;
    for value in &enumeration.values {
        writeln!(
            out,
            "    case {}: return \"{}\";",
            constant(&name, value.name),
            value.name
        )?;
    }
    writeln!(out, "    default: return \"unknown\";\n  }}\n}}")
}

fn write_structure(out: &mut String, structure: &Structure) -> std::fmt::Result {
    let name = format!("wormd_{}", snake_case(structure.name));
    write_comment(out, "", &structure.documentation)?;
    writeln!(out, "typedef struct {name} {{")?;
    for field in &structure.fields {
        write_comment(out, "  ", &about(field))?;
        let places = field.count.map(|count| match field.holds {
            "per-cell" => "[WORMD_MAX_CELLS]".to_owned(),
            _ => format!("[{count}]"),
        });
        writeln!(out, "  {} {}{};", c_type(field), field.name, places.unwrap_or_default())?;
    }
    writeln!(out, "}} {name};\n")?;
    let other = "has another size here than in wormd";
    writeln!(
        out,
        "static_assert(sizeof({name}) == {}, \"{name} {other}\");",
        structure.size
    )?;
    for field in &structure.fields {
        writeln!(
            out,
            "static_assert(offsetof({name}, {}) == {}, \"{name}.{} lies elsewhere in wormd\");",
            field.name, field.offset, field.name
        )?;
    }
    Ok(())
}

/// What a field means, and which enumeration its code is of.
fn about(field: &DescribedField) -> String {
    let mut text = field.documentation.replace("u32::MAX", "WORMD_NONE");
    if field.holds == "text" {
        text += " UTF-8; it ends with a zero, or with the array.";
    }
    if let Some(enumeration) = field.enumeration {
        text += &format!(" A code of enum wormd_{}.", snake_case(enumeration));
    }
    text
}

fn c_type(field: &DescribedField) -> &'static str {
    match (field.type_name, field.holds) {
        (_, "text") => "char",
        ("f64", _) => "double",
        ("u64", _) => "uint64_t",
        ("i32", _) => "int32_t",
        _ => "uint32_t",
    }
}

/// A comment of lines that are not too long.
fn write_comment(out: &mut String, indent: &str, text: &str) -> std::fmt::Result {
    const WIDTH: usize = 110;
    if indent.is_empty() {
        writeln!(out)?;
    }
    let mut line = format!("{indent}/*");
    for word in text.split_whitespace() {
        if line.chars().count() + word.chars().count() >= WIDTH {
            writeln!(out, "{line}")?;
            line = format!("{indent}  ");
        }
        line.push(' ');
        line.push_str(word);
    }
    writeln!(out, "{line} */")
}

/// `WORMD_HOLD_REASON_LEASE_LAPSED` of `hold_reason` and `lease-lapsed`.
fn constant(enumeration: &str, value: &str) -> String {
    format!("WORMD_{enumeration}_{}", value.replace('-', "_")).to_uppercase()
}

/// `hold_reason` of `HoldReason`.
fn snake_case(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.push(letter.to_ascii_lowercase());
    }
    text
}
