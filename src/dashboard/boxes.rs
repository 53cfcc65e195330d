//! Files of the black box as downloads that a browser, `curl -C -` or `wget -c` can take up again where they broke off.

use super::byte_range::{Wanted, wanted};
use super::response::refused;
use crate::black_box::folder::{Folder, FolderError};
use axum::body::{Body, Bytes};
use axum::http::header::{
    ACCEPT_RANGES, CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, ETAG, IF_NONE_MATCH, IF_RANGE,
    RANGE,
};
use axum::http::{HeaderMap, HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::stream::unfold;
use nix::errno::Errno;
use nix::fcntl::OFlag;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::OpenOptionsExt;
use std::time::UNIX_EPOCH;

/// How much is read at a time, bytes.
const PIECE: usize = 64 << 10;

/// A file that can be downloaded.
#[derive(Debug)]
pub(super) struct BoxFile {
    file: File,
    name: String,
    length: u64,
    /// Tells it from another file of this name.
    tag: String,
}

/// The file of this name or number; none where there is none that is complete.
///
/// # Errors
/// When the folder or the file cannot be read.
pub(super) fn open(folder: &Folder, wanted: &str) -> io::Result<Option<BoxFile>> {
    let path = match folder.find(wanted) {
        Ok(path) => path,
        Err(FolderError::NotThere { .. }) => return Ok(None),
        Err(error) => return Err(io::Error::other(error)),
    };
    let Some(name) = path.file_name().and_then(|name| name.to_str()).map(str::to_owned) else {
        return Ok(None);
    };
    // What still grows is another file with every byte.
    if !name.ends_with(".mcap") {
        return Ok(None);
    }
    // Nor what a link in the folder leads to: it may lie anywhere.
    let flags = OFlag::O_NOFOLLOW | OFlag::O_NONBLOCK;
    let opened = File::options().read(true).custom_flags(flags.bits()).open(&path);
    let file = match opened {
        Err(error) if error.raw_os_error() == Some(Errno::ELOOP as i32) => return Ok(None),
        opened => opened?,
    };
    let about = file.metadata()?;
    if !about.is_file() {
        return Ok(None);
    }
    let modified = about.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(Some(BoxFile {
        tag: format!("\"{name}-{}-{}\"", about.len(), modified.as_nanos()),
        length: about.len(),
        file,
        name,
    }))
}

impl BoxFile {
    /// What the request asks for of it.
    pub(super) fn answer(mut self, headers: &HeaderMap) -> Response {
        let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        if text(IF_NONE_MATCH) == Some(&self.tag) {
            return (StatusCode::NOT_MODIFIED, [(ETAG, self.tag)]).into_response();
        }
        // A part of another file than that of which the client has the beginning would spoil it.
        let is_same = text(IF_RANGE).is_none_or(|tag| tag == self.tag);
        let range = text(RANGE).filter(|_| is_same);
        let (status, bytes) = match wanted(range, self.length) {
            Wanted::Whole => (StatusCode::OK, 0..self.length),
            Wanted::Part(bytes) => (StatusCode::PARTIAL_CONTENT, bytes),
            Wanted::Beyond => {
                let all = format!("bytes */{}", self.length);
                let why = format!("{} has {} bytes", self.name, self.length);
                return ([(CONTENT_RANGE, all)], refused(StatusCode::RANGE_NOT_SATISFIABLE, &why)).into_response();
            }
        };
        let head = [
            (CONTENT_TYPE, "application/octet-stream".to_owned()),
            (CONTENT_DISPOSITION, format!("attachment; filename=\"{}\"", self.name)),
            (CONTENT_LENGTH, (bytes.end - bytes.start).to_string()),
            (ACCEPT_RANGES, "bytes".to_owned()),
            (ETAG, self.tag),
        ];
        if let Err(error) = self.file.seek(SeekFrom::Start(bytes.start)) {
            return refused(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string());
        }
        let body = pieces(self.file.take(bytes.end - bytes.start));
        let mut response = (status, head, body).into_response();
        if status == StatusCode::PARTIAL_CONTENT
            && let Ok(part) = format!("bytes {}-{}/{}", bytes.start, bytes.end - 1, self.length).parse()
        {
            response.headers_mut().insert(CONTENT_RANGE, part);
        }
        response
    }
}

/// A body that is read piece by piece as there is room for it: boxes are larger than what may wait for a reader.
fn pieces(file: impl Read + Send + 'static) -> Body {
    Body::from_stream(unfold(Some(file), |file| async move {
        let mut file = file?;
        let read = tokio::task::spawn_blocking(move || {
            let mut piece = Vec::with_capacity(PIECE);
            file.by_ref().take(PIECE as u64).read_to_end(&mut piece)?;
            io::Result::Ok((piece, file))
        });
        match read.await.map_err(io::Error::other).flatten() {
            Ok((piece, _)) if piece.is_empty() => None,
            Ok((piece, file)) => Some((Ok(Bytes::from(piece)), Some(file))),
            Err(error) => Some((Err(error), None)),
        }
    }))
}
