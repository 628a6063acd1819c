//! The stage's summary.

use afmid_pipeline::{Document, StageError};
use serde_json::{Value, json};

use super::ErrorSource;
use super::tables::named;
use crate::artifacts::mode_document;
use afmid_kernels::ringdown::{ModeCount, ModeEstimate, Ringdown};

/// The summary; numbers that are unknown are null.
pub(super) fn summary(
    fit: &Ringdown,
    modes: &[ModeEstimate],
    error_source: ErrorSource,
    missing: usize,
    free_windows: usize,
    seen: &[ModeCount],
) -> Result<Document, StageError> {
    Document::new(&json!({
        "modes": modes.iter().map(mode_document).collect::<Vec<Value>>(),
        "events": fit.events.len(),
        "error_source": error_source,
        "converged": fit.verdict.converged,
        "steps": fit.verdict.steps,
        "reduced_chi_square": fit.reduced_chi_square,
        "white_noise_std_v": fit.noise.white.sqrt(),
        "coloured_noise_std_v": fit.noise.wander.iter().map(|part| part.variance).sum::<f64>().sqrt(),
        "thermal_std_v": fit.noise.thermal.iter().map(|mode| mode.variance.sqrt()).collect::<Vec<f64>>(),
        "missing_samples": missing,
        "free_windows": free_windows,
        "fixed": fit.fixed.iter().map(|quantity| named(*quantity)).collect::<Vec<String>>(),
        "on_bound": fit.on_bound.iter().map(|quantity| named(*quantity)).collect::<Vec<String>>(),
        "mode_numbers": seen.iter().map(count).collect::<Vec<Value>>(),
    }))
}

fn count(count: &ModeCount) -> Value {
    json!({
        "modes": count.modes,
        "chi_square": count.chi_square,
        "bic": count.bic,
        "held_out_chi_square": count.held_out,
        "worse_than_chosen_by_std": count.worse_by,
    })
}
