//! `include/wormd.h`, compiled as C and C++: it has the layout of the Rust types, and reads what Rust wrote.
//!
//! Without a compiler the tests say so and pass.

use std::io::Write;
use std::process::{Command, Stdio};
use worm_estimator::message::{
    AlarmKind, Command as Order, CommandKind, InMemory, Layout, Mode, Reply, ShortText, State,
};
use wormd::topics::describe_topics;

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// The languages that the header is for: compiler, its name for the language, the standard.
const LANGUAGES: [(&str, &str, &str); 2] = [("cc", "c", "c11"), ("c++", "c++", "c++17")];

/// Compiles and runs a program that includes the header; what it prints for this input. Nothing where there is no compiler.
fn run((compiler, language, standard): (&str, &str, &str), program: &str, input: &[u8]) -> Option<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, binary) = (folder.path().join("program"), folder.path().join("binary"));
    std::fs::write(&source, program).expect("a temporary file");
    let compiled = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-x", language])
        .arg(format!("-std={standard}"))
        .arg(format!("-I{FOLDER}/include"))
        .arg(&source)
        .arg("-o")
        .arg(&binary)
        .output();
    let Ok(compiled) = compiled else {
        println!("SKIPPED: there is no compiler {compiler}");
        return None;
    };
    assert!(
        compiled.status.success(),
        "{language}: {}",
        String::from_utf8_lossy(&compiled.stderr)
    );
    let mut process = Command::new(&binary)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut pipe = process.stdin.take().expect("a pipe");
    pipe.write_all(input).expect("it reads");
    drop(pipe);
    let output = process.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{language}");
    Some(String::from_utf8(output.stdout).expect("text"))
}

#[test]
fn sizes_and_offsets_are_those_of_rust() {
    let layouts: Vec<Layout> = describe_topics()
        .iter()
        .map(|topic| topic.layout)
        .chain([Order::LAYOUT, Reply::LAYOUT])
        .collect();
    let (mut program, mut expected) = (
        "#include <stdio.h>\n#include \"wormd.h\"\nint main(void) {\n".to_owned(),
        String::new(),
    );
    for layout in &layouts {
        let name = format!("wormd_{}", snake_case(layout.name));
        program += &format!("  printf(\"{name} %zu\\n\", sizeof({name}));\n");
        expected += &format!("{name} {}\n", layout.size);
        for field in layout.fields {
            let place = format!("offsetof({name}, {0}), sizeof((({name} *)0)->{0})", field.name);
            program += &format!("  printf(\"{} %zu %zu\\n\", {place});\n", field.name);
            expected += &format!("{} {} {}\n", field.name, field.offset, field.size);
        }
    }
    for topic in describe_topics() {
        let name = topic.name.to_uppercase();
        program += &format!("  puts(WORMD_{name}_TOPIC \" \" WORMD_{name}_TYPE);\n");
        expected += &format!("{} {}\n", topic.name, topic.layout.type_name);
    }
    program += "  return 0;\n}\n";
    for language in LANGUAGES {
        if let Some(printed) = run(language, &program, &[]) {
            assert_eq!(printed, expected, "{language:?}");
        }
    }
}

#[test]
fn messages_of_rust_are_read() {
    const PROGRAM: &str = r#"
#include <stdio.h>
#include "wormd.h"
int main(void) {
  wormd_state state;
  wormd_command command;
  if (fread(&state, sizeof state, 1, stdin) != 1 || fread(&command, sizeof command, 1, stdin) != 1) return 1;
  printf("%llu %.17g %s %s %s\n", (unsigned long long)state.sequence, state.phase, wormd_mode_name(state.mode),
         wormd_alarm_kind_name(state.fault_alarm), state.emergency_stop == WORMD_NONE ? "none" : "some");
  for (uint32_t cell = 0; cell < state.cell_count; cell++) printf("%.17g\n", state.position_m[cell]);
  printf("%d %.17g %.*s\n", command.kind == WORMD_COMMAND_KIND_CRAWL, command.cycles_per_s, (int)sizeof command.sender, command.sender);
  printf("%s\n", wormd_mode_name(99));
  return 0;
}
"#;
    let mut state = State::unknown(2);
    state.sequence = u64::MAX;
    state.phase = 0.1;
    state.position_m[..2].copy_from_slice(&[-0.25, f64::NAN]);
    state.mode = Mode::Stopping.code();
    state.fault_alarm = AlarmKind::JammedCell.code();
    let command = Order {
        cycles_per_s: -0.4,
        sender: ShortText::new("a sender of 32 bytes without an0"),
        ..Order::new(CommandKind::Crawl)
    };
    let input = [bytes_of(&state), bytes_of(&command)].concat();
    let expected = "18446744073709551615 0.10000000000000001 stopping jammed-cell none\n-0.25\nnan\n1 -0.40000000000000002 a sender of 32 bytes \
                    without an0\nunknown\n";
    for language in LANGUAGES {
        if let Some(printed) = run(language, PROGRAM, &input) {
            assert_eq!(printed, expected, "{language:?}");
        }
    }
}

/// A message as it lies in memory.
fn bytes_of<T: InMemory>(message: &T) -> &[u8] {
    let sizes: usize = T::LAYOUT.fields.iter().map(|field| field.size).sum();
    assert_eq!(sizes, size_of::<T>(), "there is no padding");
    // SAFETY: it is valid for its size, and has no padding, so that all of its bytes are initialised.
    unsafe { std::slice::from_raw_parts(std::ptr::from_ref(message).cast(), size_of::<T>()) }
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
