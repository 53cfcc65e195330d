//! A tar archive, compressed with zstd, that lists what it holds, with checksums, and what it lacks, with reasons.

use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use tar::{Builder, Header};
use zstd::Encoder;

/// How hard zstd tries: texts shrink well, and boxes are compressed already.
const LEVEL: i32 = 6;
/// The last part.
const MANIFEST: &str = "manifest.json";

/// An archive under way. Its file has its name only once it is complete.
pub(crate) struct Archive {
    path: PathBuf,
    tar: Builder<Encoder<'static, File>>,
    manifest: Manifest,
    /// All parts lie in a folder of this name.
    folder: String,
    unix_s: u64,
}

/// What an archive holds. Its field names are a contract.
#[derive(Debug, Serialize)]
struct Manifest {
    wormd_version: &'static str,
    worm: String,
    /// When it was made, s since 1970.
    created_unix_s: u64,
    parts: Vec<Part>,
    missing: Vec<Missing>,
    left_out: &'static str,
}

/// A file in it.
#[derive(Debug, Serialize)]
struct Part {
    name: String,
    bytes: u64,
    sha256: String,
}

/// A part that it lacks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Missing {
    /// The part.
    pub name: String,
    /// Why.
    pub reason: String,
}

impl Archive {
    /// Begins an archive that will be `path`.
    ///
    /// # Errors
    /// From the operating system.
    pub(crate) fn begin(path: &Path, worm: &str) -> io::Result<Self> {
        let encoder = Encoder::new(File::create(part_path(path))?, LEVEL)?;
        let created = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Ok(Self {
            path: path.to_owned(),
            tar: Builder::new(encoder),
            manifest: Manifest {
                wormd_version: env!("CARGO_PKG_VERSION"),
                worm: worm.to_owned(),
                created_unix_s: created.as_secs(),
                parts: Vec::new(),
                missing: Vec::new(),
                left_out: super::redact::LEFT_OUT,
            },
            folder: format!("{worm}-support"),
            unix_s: created.as_secs(),
        })
    }

    /// Adds a part, or notes why it is missing.
    ///
    /// # Errors
    /// When the archive cannot be written.
    pub(crate) fn add(&mut self, name: &str, contents: Result<Vec<u8>, String>) -> io::Result<()> {
        match contents {
            Ok(contents) => self.append(name, contents.len() as u64, contents.as_slice()),
            Err(reason) => {
                self.manifest.missing.push(Missing {
                    name: name.to_owned(),
                    reason,
                });
                Ok(())
            }
        }
    }

    /// Adds a file as it is now, though somebody may be writing to it.
    ///
    /// # Errors
    /// When the archive cannot be written; a file that cannot be read is missing.
    pub(crate) fn add_file(&mut self, name: &str, path: &Path) -> io::Result<()> {
        let opened = File::open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
        match opened {
            // What is written meanwhile does not belong to it; a file that shrinks is filled up.
            Ok((length, file)) => self.append(name, length, file.take(length).chain(io::repeat(0)).take(length)),
            Err(error) => self.add(name, Err(format!("{}: {error}", path.display()))),
        }
    }

    fn append(&mut self, name: &str, length: u64, contents: impl Read) -> io::Result<()> {
        let mut header = Header::new_gnu();
        header.set_size(length);
        header.set_mode(0o644);
        header.set_mtime(self.unix_s);
        let mut summed = Summed::new(contents);
        self.tar
            .append_data(&mut header, format!("{}/{name}", self.folder), &mut summed)?;
        let (bytes, sha256) = summed.finish();
        self.manifest.parts.push(Part {
            name: name.to_owned(),
            bytes,
            sha256,
        });
        Ok(())
    }

    /// Removes what is left of the archive that would have been `path`: its part takes room that may be needed.
    pub(crate) fn abandon(path: &Path) {
        let part = part_path(path);
        if let Err(error) = std::fs::remove_file(&part) {
            tracing::warn!("{}: cannot be removed: {error}", part.display());
        }
    }

    /// Completes the archive; returns what it lacks, and its length.
    ///
    /// # Errors
    /// From the operating system.
    pub(crate) fn finish(mut self) -> io::Result<(Vec<Missing>, u64)> {
        let manifest = serde_json::to_vec_pretty(&self.manifest).map_err(io::Error::other)?;
        let mut header = Header::new_gnu();
        header.set_size(manifest.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(self.unix_s);
        let name = format!("{}/{MANIFEST}", self.folder);
        self.tar.append_data(&mut header, name, manifest.as_slice())?;
        let file = self.tar.into_inner()?.finish()?;
        file.sync_all()?;
        std::fs::rename(part_path(&self.path), &self.path)?;
        Ok((self.manifest.missing, file.metadata()?.len()))
    }
}

fn part_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// A reader that sums up what is read from it.
struct Summed<R> {
    inner: R,
    digest: Sha256,
    bytes: u64,
}

impl<R: Read> Summed<R> {
    fn new(inner: R) -> Self {
        Self {
            inner,
            digest: Sha256::new(),
            bytes: 0,
        }
    }

    fn finish(self) -> (u64, String) {
        let digits = self
            .digest
            .finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        (self.bytes, digits)
    }
}

impl<R: Read> Read for Summed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.digest.update(&buffer[..read]);
        self.bytes += read as u64;
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::black_box::copy::sha256;
    use std::collections::BTreeMap;

    #[test]
    fn an_archive_lists_what_it_holds_and_what_it_lacks() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.tar.zst");
        let mut archive = Archive::begin(&path, "worm1").expect("room");
        archive.add("a.txt", Ok(b"alpha".to_vec())).expect("room");
        archive.add("b.txt", Err("it is elsewhere".to_owned())).expect("room");
        archive.add_file("c.bin", &folder.path().join("nowhere")).expect("room");
        let (missing, _) = archive.finish().expect("room");
        assert_eq!(missing.len(), 2);

        let mut tar = tar::Archive::new(zstd::Decoder::new(File::open(&path).expect("there")).expect("zstd"));
        let mut parts = BTreeMap::new();
        for entry in tar.entries().expect("a tar") {
            let mut entry = entry.expect("whole");
            let name = entry.path().expect("a path").display().to_string();
            let mut contents = Vec::new();
            entry.read_to_end(&mut contents).expect("whole");
            parts.insert(name, contents);
        }
        assert_eq!(parts["worm1-support/a.txt"], b"alpha");
        let manifest: serde_json::Value = serde_json::from_slice(&parts["worm1-support/manifest.json"]).expect("JSON");
        let (_, sum) = sha256(&b"alpha"[..]).expect("in memory");
        assert_eq!(manifest["parts"][0]["sha256"], sum);
        assert_eq!(manifest["missing"][0]["reason"], "it is elsewhere");
    }
}
