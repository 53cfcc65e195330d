//! The stream of events for one page.

use super::feed::Cursor;
use super::relay_thread::Shared;
use crate::realtime::monotonic_ns;
use axum::body::{Body, Bytes};
use futures_util::stream::unfold;
use std::convert::Infallible;
use tokio::sync::watch;

/// Begins each stream: a browser that connects again by itself waits so long, ms.
const PREAMBLE: &[u8] = b"retry: 1000\n\n";

/// One page.
struct Page {
    shared: Shared,
    changed: watch::Receiver<()>,
    cursor: Cursor,
    has_begun: bool,
}

/// The body of the answer: goes on for as long as the page is there. What is sent is made when there is room for it.
pub(super) fn body(shared: &Shared) -> Body {
    let page = Page {
        changed: shared.subscribe(),
        shared: shared.clone(),
        cursor: Cursor::default(),
        has_begun: false,
    };
    Body::from_stream(unfold(page, |mut page| async move {
        let event = page.next_event().await?;
        Some((Ok::<_, Infallible>(event), page))
    }))
}

impl Page {
    async fn next_event(&mut self) -> Option<Bytes> {
        if !std::mem::replace(&mut self.has_begun, true) {
            return Some(Bytes::from_static(PREAMBLE));
        }
        loop {
            let event = self.shared.feed().next_event(&mut self.cursor, monotonic_ns());
            if event.is_some() {
                return event;
            }
            // At the end of the dashboard there is nobody left to change anything.
            self.changed.changed().await.ok()?;
        }
    }
}
