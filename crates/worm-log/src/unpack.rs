//! How much a compressed chunk may hold, and what unpacking it may take.

use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use zstd::zstd_safe::{DCtx, DParameter, InBuffer, OutBuffer, ResetDirective, SafeResult, get_error_name};

/// Chunks that unpack to more than this multiple are damaged, or made to fill the memory. The times in the messages alone keep those of a
/// worm far below it, even at rest: 5.5 is the most that was seen.
pub(super) const MAX_RATIO: u64 = 64;

/// How far back zstd may look, as a power of two: 8 MB, which the decoder reserves. Its own limit is 128 MB; the highest level that all
/// readers support needs 8.
const MAX_WINDOW_LOG: u32 = 23;

/// The zstd of `mcap` with a limit to what a file can make it reserve.
pub(super) struct BoundedZstd {
    context: DCtx<'static>,
    next_read: usize,
}

impl BoundedZstd {
    pub(super) fn new() -> McapResult<Self> {
        let mut context = DCtx::create();
        checked(context.set_parameter(DParameter::WindowLogMax(MAX_WINDOW_LOG)))?;
        Ok(Self { context, next_read: 0 })
    }
}

fn checked(result: SafeResult) -> McapResult<usize> {
    result.map_err(|code| McapError::DecompressionError(get_error_name(code).to_owned()))
}

impl Decompressor for BoundedZstd {
    fn next_read_size(&self) -> usize {
        self.next_read
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let (mut source, mut sink) = (InBuffer::around(src), OutBuffer::around(dst));
        self.next_read = checked(self.context.decompress_stream(&mut sink, &mut source))?;
        Ok(DecompressResult {
            consumed: source.pos,
            wrote: sink.pos(),
        })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.next_read = 0;
        checked(self.context.reset(ResetDirective::SessionOnly)).map(|_| ())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}
