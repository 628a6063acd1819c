//! What the force does between its samples, as found or given.

use afmid_kernels::grey::{DISTINGUISHABLE, Grey, Intersample, IntersampleChoice};
use serde_json::{Value, json};

/// As the parameter `between` has it.
pub(super) fn name_of(kind: Intersample) -> &'static str {
    match kind {
        Intersample::Held => "held",
        Intersample::Linear => "linear",
        Intersample::BandLimited => "band-limited",
    }
}

/// The kind, how it was chosen, and by how much.
pub(super) fn between_document(fit: &Grey) -> Value {
    let choice = fit.intersample.as_ref();
    let advantage =
        |kind: Intersample| choice.and_then(|c| c.fits.iter().find(|f| f.kind == kind)).map(|f| f.advantage);
    json!({
        "kind": name_of(fit.model.between),
        "chosen_by": if choice.is_some() { "data" } else { "parameter" },
        "verdict": choice.map(verdict),
        "distinguishable": choice.map(IntersampleChoice::distinguishable),
        "likeliest": choice.map(|choice| name_of(choice.likeliest())),
        "lead_in_2_log_likelihood": choice.map(|choice| choice.lead),
        "level": DISTINGUISHABLE,
        "over_held_in_2_log_likelihood": {
            "held": advantage(Intersample::Held),
            "linear": advantage(Intersample::Linear),
            "band_limited": advantage(Intersample::BandLimited),
        },
        "noise_order": choice.map(|choice| choice.noise_order),
        "samples": choice.map(|choice| choice.samples),
    })
}

/// One sentence.
fn verdict(choice: &IntersampleChoice) -> String {
    let (likeliest, chosen, lead) = (name_of(choice.likeliest()), name_of(choice.chosen), choice.lead);
    if choice.distinguishable() {
        return format!("{likeliest}: twice its log likelihood is {lead:.1} above that of the next");
    }
    if lead.is_nan() {
        return format!("not distinguishable: no other kind has a fit; {chosen} is kept");
    }
    let kept = if choice.chosen == choice.likeliest() { "taken" } else { "kept" };
    format!(
        "not distinguishable: twice the log likelihood of {likeliest} is {lead:.1} above that of the next, less than {DISTINGUISHABLE:.2}; {chosen} is {kept}"
    )
}
