//! Reports of finished runs: folders with a `report.html`, as `analyze`, `explain` and `plan` write them.
//!
//! What a request names is never made into a path. The folders are listed, and a request has to name one of what was found; links are
//! not followed. So nothing outside the folder can be asked for, whatever the request says.

use serde::Serialize;
use std::fs::{self, DirEntry};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// The page of a report.
const PAGE: &str = "report.html";
/// How deep reports may lie: a campaign has one folder for each run.
const MAX_DEPTH: usize = 3;
/// Most reports, and most entries of a folder that are looked at.
const MAX_REPORTS: usize = 1000;
const MAX_ENTRIES: usize = 10_000;
/// Largest file that is given out, bytes.
const MAX_FILE: u64 = 64 << 20;

/// What may lie beside the page, by the end of its name.
const TYPES: [(&str, &str); 7] = [
    (".html", "text/html; charset=utf-8"),
    (".csv", "text/csv; charset=utf-8"),
    (".json", "application/json"),
    (".toml", "text/plain; charset=utf-8"),
    (".diff", "text/plain; charset=utf-8"),
    (".svg", "image/svg+xml"),
    (".png", "image/png"),
];

/// A report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Report {
    /// Its folder, below the folder of reports; `.` for that itself.
    pub(super) name: String,
    /// What its page calls itself.
    pub(super) title: String,
    /// When it was written, s since 1970.
    pub(super) modified_s: u64,
    /// Where the page can be opened.
    pub(super) url: String,
}

/// A file of a report.
#[derive(Debug)]
pub(super) struct ReportFile {
    pub(super) content_type: &'static str,
    pub(super) bytes: Vec<u8>,
}

/// All reports below `root`, the newest first.
///
/// # Errors
/// When the folder cannot be read.
pub(super) fn list(root: &Path) -> io::Result<Vec<Report>> {
    let mut found = Vec::new();
    fs::read_dir(root)?;
    collect(root, "", MAX_DEPTH, &mut found);
    found.sort_by(|one, other| (other.modified_s, &one.name).cmp(&(one.modified_s, &other.name)));
    Ok(found)
}

fn collect(folder: &Path, name: &str, depth: usize, found: &mut Vec<Report>) {
    for entry in entries(folder) {
        if found.len() >= MAX_REPORTS {
            return;
        }
        let (Ok(kind), Some(file)) = (entry.file_type(), plain_name(&entry)) else {
            continue;
        };
        if kind.is_dir() && depth > 0 {
            collect(&entry.path(), &format!("{name}{file}/"), depth - 1, found);
        } else if kind.is_file() && file == PAGE {
            found.extend(report(&entry.path(), name));
        }
    }
}

fn report(page: &Path, name: &str) -> Option<Report> {
    let modified = fs::metadata(page).and_then(|about| about.modified()).ok()?;
    let mut head = Vec::new();
    fs::File::open(page).ok()?.take(4096).read_to_end(&mut head).ok()?;
    let head = String::from_utf8_lossy(&head);
    let title = head
        .split_once("<title>")
        .and_then(|(_, rest)| rest.split_once("</title>"));
    let folder = name.trim_end_matches('/');
    let name = if folder.is_empty() { "." } else { folder };
    Some(Report {
        title: title.map_or(name, |(title, _)| title).trim().to_owned(),
        name: name.to_owned(),
        modified_s: modified.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()),
        url: format!(
            "/reports/{}{PAGE}",
            if folder.is_empty() {
                String::new()
            } else {
                format!("{folder}/")
            }
        ),
    })
}

/// The file that a request names, as far as it lies in the folder of a report.
///
/// # Errors
/// When it cannot be read, or is too large.
pub(super) fn open(root: &Path, wanted: &str) -> io::Result<Option<ReportFile>> {
    let Some((_, content_type)) = TYPES.iter().find(|(end, _)| wanted.ends_with(end)) else {
        return Ok(None);
    };
    let Some(path) = descend(root, wanted) else {
        return Ok(None);
    };
    // Only what belongs to a report.
    if !path.with_file_name(PAGE).is_file() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(MAX_FILE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE {
        return Err(io::Error::other(format!("it is larger than {} MB", MAX_FILE >> 20)));
    }
    Ok(Some(ReportFile { content_type, bytes }))
}

/// Goes down from entry to entry, each of which must be there under this name, and no link.
fn descend(root: &Path, wanted: &str) -> Option<PathBuf> {
    let parts: Vec<_> = wanted.split('/').collect();
    let (file, folders) = parts.split_last()?;
    if folders.len() > MAX_DEPTH {
        return None;
    }
    let step = |folder: &Path, name: &str, is_right: fn(&fs::FileType) -> bool| {
        let mut entries = entries(folder);
        let entry = entries.find(|entry| plain_name(entry).as_deref() == Some(name))?;
        entry
            .file_type()
            .is_ok_and(|kind| is_right(&kind))
            .then(|| entry.path())
    };
    let mut folder = root.to_path_buf();
    for name in folders {
        folder = step(&folder, name, fs::FileType::is_dir)?;
    }
    step(&folder, file, fs::FileType::is_file)
}

fn entries(folder: &Path) -> impl Iterator<Item = DirEntry> + use<> {
    let entries = fs::read_dir(folder);
    entries.into_iter().flatten().flatten().take(MAX_ENTRIES)
}

/// The name of an entry, if it is one that a request can name.
fn plain_name(entry: &DirEntry) -> Option<String> {
    let name = entry.file_name().into_string().ok()?;
    (!name.starts_with('.')).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_found_and_nothing_else_is_given_out() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().join("reports");
        let write = |path: &str, text: &str| {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().expect("has one")).expect("can be made");
            fs::write(path, text).expect("can be written");
        };
        write("reports/why/report.html", "<!DOCTYPE html><title>Why it slips</title>");
        write("reports/why/report.json", "{}");
        write("reports/why/run-1/report.html", "no title");
        write("reports/why/run-1/series.csv", "t");
        write("reports/why/model.key", "secret");
        write("reports/notes/notes.html", "no report");
        write("reports/.hidden/report.html", "hidden");
        write("secret.html", "secret");
        write("elsewhere/report.html", "elsewhere");
        std::os::unix::fs::symlink(folder.path().join("elsewhere"), root.join("link")).expect("a link");
        std::os::unix::fs::symlink(folder.path().join("secret.html"), root.join("why/link.html")).expect("a link");

        let reports = list(&root).expect("can be listed");
        let mut names: Vec<_> = reports
            .iter()
            .map(|report| (report.name.as_str(), report.title.as_str()))
            .collect();
        names.sort_unstable();
        assert_eq!(names, [("why", "Why it slips"), ("why/run-1", "why/run-1")]);
        for (wanted, is_there) in [
            ("why/report.html", true),
            ("why/report.json", true),
            ("why/run-1/report.html", true),
            ("why/run-1/series.csv", true),
            ("why/model.key", false),
            ("why", false),
            ("notes/notes.html", false),
            (".hidden/report.html", false),
            ("link/report.html", false),
            ("why/link.html", false),
            ("../secret.html", false),
            ("why/../../secret.html", false),
            ("../elsewhere/report.html", false),
            ("/etc/passwd.html", false),
            ("why//report.html", false),
            ("./why/report.html", false),
            ("why/report.html/", false),
            ("why\0/report.html", false),
            ("", false),
        ] {
            let file = open(&root, wanted).expect("can be read");
            assert_eq!(file.is_some(), is_there, "{wanted:?}");
        }
        assert!(list(&folder.path().join("none")).is_err());
    }
}
