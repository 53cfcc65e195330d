//! Whether a logout removes a running worm's topics: systemd-logind removes shared memory and the runtime folder of an ordinary user
//! when its last session ends (logind.conf(5), `RemoveIPC`).

use super::{CheckItem, Level};
use std::path::Path;

/// User ids below this are of the system; logind leaves their memory alone.
const FIRST_ORDINARY_USER: u32 = 1000;

/// The check of this computer for the calling user; nothing where it does not apply.
pub(super) fn findings() -> Option<CheckItem> {
    let user = nix::unistd::geteuid().as_raw();
    if user < FIRST_ORDINARY_USER || !Path::new("/run/systemd/seats").exists() {
        return None;
    }
    let name = nix::unistd::User::from_uid(user.into())
        .ok()
        .flatten()
        .map(|user| user.name);
    let lingers = name.is_some_and(|name| Path::new("/var/lib/systemd/linger").join(name).exists());
    Some(finding(removes_ipc(&settings()), lingers))
}

fn finding(removes_ipc: bool, lingers: bool) -> CheckItem {
    let (level, found, remedy) = match (removes_ipc, lingers) {
        (_, true) => (Level::Good, "this user lingers: its worms stay when it logs out", None),
        (true, false) => (
            Level::Warning,
            "systemd-logind removes this user's shared memory at logout (RemoveIPC), and with it a running worm's topics; the worm \
             then stops",
            Some("loginctl enable-linger, or RemoveIPC=no in /etc/systemd/logind.conf"),
        ),
        (false, false) => (
            Level::Good,
            "systemd-logind leaves shared memory alone (RemoveIPC=no)",
            None,
        ),
    };
    CheckItem {
        level,
        subject: "logout",
        found: found.to_owned(),
        remedy: remedy.map(str::to_owned),
    }
}

/// The text of logind's settings, in the order in which they count.
fn settings() -> Vec<String> {
    let mut files = vec![Path::new("/etc/systemd/logind.conf").to_path_buf()];
    let mut more: Vec<_> = [
        "/usr/lib/systemd/logind.conf.d",
        "/run/systemd/logind.conf.d",
        "/etc/systemd/logind.conf.d",
    ]
    .iter()
    .filter_map(|folder| std::fs::read_dir(folder).ok())
    .flatten()
    .flatten()
    .map(|entry| entry.path())
    .filter(|path| path.extension().is_some_and(|extension| extension == "conf"))
    .collect();
    more.sort_by_key(|path| path.file_name().map(std::ffi::OsStr::to_owned));
    files.extend(more);
    files
        .iter()
        .filter_map(|file| std::fs::read_to_string(file).ok())
        .collect()
}

/// Whether these settings let logind remove shared memory: by default it does, and the last word counts.
fn removes_ipc(settings: &[String]) -> bool {
    let lines = settings.iter().flat_map(|text| text.lines());
    let mut values = lines.filter_map(|line| line.trim().strip_prefix("RemoveIPC")?.trim_start().strip_prefix('='));
    values.next_back().is_none_or(|value| {
        let value = value.trim().to_ascii_lowercase();
        value.is_empty() || ["yes", "true", "on", "1"].contains(&value.as_str())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_word_of_logind_s_settings_counts() {
        for (settings, removes) in [
            (&[][..], true),
            (&["[Login]\n#RemoveIPC=no\n"], true),
            (&["[Login]\nRemoveIPC=no\n"], false),
            (&["[Login]\nRemoveIPC = yes\n", "[Login]\nRemoveIPC=off\n"], false),
            (&["RemoveIPC=no", "RemoveIPC=1"], true),
        ] {
            let texts: Vec<String> = settings.iter().map(|text| (*text).to_owned()).collect();
            assert_eq!(removes_ipc(&texts), removes, "{settings:?}");
        }
    }

    #[test]
    fn a_logout_that_takes_the_topics_is_a_warning_unless_the_user_lingers() {
        for (removes, lingers, level) in [
            (true, false, Level::Warning),
            (true, true, Level::Good),
            (false, false, Level::Good),
        ] {
            assert_eq!(finding(removes, lingers).level, level);
        }
    }
}
