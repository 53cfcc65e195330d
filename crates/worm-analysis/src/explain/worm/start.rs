//! The crawl with which a recording begins.

use super::observed::Observed;
use worm_physics::{Crawl, Mechanics};

/// Cycles that are run before a recording that begins in the middle of a crawl, and the parts of each.
pub(in crate::explain) const LEAD_CYCLES: usize = 5;
const LEAD_PARTS: usize = 40;

/// The crawl at the first sample of a recording: at rest where the worm was laid down, else after some cycles; none where it slides
/// down.
pub(in crate::explain) fn start(
    observed: &Observed<'_>,
    mechanics: &Mechanics,
    phase: f64,
    damping: f64,
    lead_cycles: usize,
) -> Option<Crawl> {
    let first_m = &observed.first_m;
    if observed.laid_down {
        return Crawl::at_rest(mechanics, phase, first_m, Some(damping)).ok();
    }
    let begin = phase - lead_cycles as f64;
    let step_s = observed.cycle_s / LEAD_PARTS as f64;
    let mut crawl = Crawl::at_rest(mechanics, begin, first_m, Some(damping)).ok()?;
    for part in 1..=lead_cycles * LEAD_PARTS {
        let here = begin + part as f64 / LEAD_PARTS as f64;
        crawl.advance_to(mechanics, here, step_s).ok()?;
    }
    crawl.begin_at_phase(mechanics, phase, first_m);
    Some(crawl)
}
