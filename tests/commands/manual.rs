//! Man pages and completions for a package.

use super::workspace::{Workspace, said, wormd};

#[test]
fn every_command_that_is_shown_has_a_page_and_is_completed() {
    let workspace = Workspace::new();
    let out = workspace.path("manual");
    let output = wormd(&["manual".as_ref(), "--out".as_ref(), out.as_os_str()]);
    assert!(output.status.success(), "{}", said(&output));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap_or_default();
    let help = wormd(&["--help"]);
    let help = String::from_utf8_lossy(&help.stdout);
    let commands: Vec<_> = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|command| *command != "help")
        .collect();
    assert!(
        commands.contains(&"control") && commands.contains(&"status"),
        "{commands:?}"
    );
    for command in commands {
        let page = read(&format!("man/wormd-{command}.1"));
        assert!(page.contains(".TH") && page.contains("SYNOPSIS"), "{command}: {page}");
        for shell in ["wormd.bash", "wormd.fish", "_wormd"] {
            let completions = read(&format!("completions/{shell}"));
            assert!(completions.contains(command), "{shell} does not know {command}");
        }
    }
    assert!(read("man/wormd.1").contains("wormd"));
    for hidden in ["manual", "help", "latency-floor"] {
        assert!(
            read(&format!("man/wormd-{hidden}.1")).is_empty(),
            "{hidden} is not for users"
        );
    }
}
