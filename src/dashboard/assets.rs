//! The page: plain files that are part of the program, so that it needs no network.

/// Version of the program.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// One file.
#[derive(Debug)]
pub(super) struct Asset {
    /// Its path below `/assets/`.
    pub(super) path: &'static str,
    /// Its `Content-Type`.
    pub(super) content_type: &'static str,
    /// What is in it.
    pub(super) text: &'static str,
}

const CSS: &str = "text/css; charset=utf-8";
const JS: &str = "text/javascript; charset=utf-8";
const TEXT: &str = "text/plain; charset=utf-8";

/// The page itself.
pub(super) const INDEX: Asset = Asset {
    path: "",
    content_type: "text/html; charset=utf-8",
    text: include_str!("assets/index.html"),
};

/// The page about all worms.
pub(super) const FLEET: Asset = Asset {
    path: "",
    content_type: "text/html; charset=utf-8",
    text: include_str!("assets/fleet.html"),
};

macro_rules! assets {
    ($($path:literal: $content_type:expr),+ $(,)?) => {
        &[$(Asset { path: $path, content_type: $content_type, text: include_str!(concat!("assets/", $path)) }),+]
    };
}

/// What it loads.
pub(super) const ASSETS: &[Asset] = assets! {
    "style.css": CSS,
    "icon.svg": "image/svg+xml",
    "main.js": JS,
    "stream.js": JS,
    "store.js": JS,
    "drive.js": JS,
    "worm.js": JS,
    "inferred.js": JS,
    "panels.js": JS,
    "charts.js": JS,
    "reports.js": JS,
    "boxes.js": JS,
    "listing.js": JS,
    "fleet.js": JS,
    "dom.js": JS,
    "uplot/uPlot.iife.min.js": JS,
    "uplot/uPlot.min.css": CSS,
    "uplot/LICENSE": TEXT,
};

impl Asset {
    /// Tells this version of the file from others.
    pub(super) fn tag(&self) -> String {
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(self.text.as_bytes());
        format!("\"{VERSION}-{checksum:08x}\"")
    }
}

/// The file of this path.
pub(super) fn find(path: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|asset| asset.path == path)
}
