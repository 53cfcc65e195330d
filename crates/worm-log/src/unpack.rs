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

/// The bytes of a chunk that this version has written, which is compressed by zstd or not at all.
///
/// # Errors
/// [`McapError`] when it is damaged, or claims to hold more than a chunk can.
pub(super) fn unpacked(compression: &str, packed: &[u8], size: u64) -> McapResult<Vec<u8>> {
    let refused = |problem: &str| McapError::DecompressionError(problem.to_owned());
    if size > (packed.len() as u64).saturating_mul(MAX_RATIO) {
        return Err(refused("the chunk claims to hold more than a chunk can"));
    }
    match compression {
        "" => Ok(packed.to_vec()),
        "zstd" => {
            let mut bytes = vec![0; size as usize];
            let (mut zstd, mut read, mut wrote) = (BoundedZstd::new()?, 0, 0);
            while wrote < bytes.len() {
                let step = zstd.decompress(&packed[read..], &mut bytes[wrote..])?;
                if step.consumed == 0 && step.wrote == 0 {
                    return Err(refused("the chunk holds less than it claims"));
                }
                read += step.consumed;
                wrote += step.wrote;
            }
            Ok(bytes)
        }
        other => Err(refused(&format!(
            "compression {other:?} is not one that is written here"
        ))),
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
