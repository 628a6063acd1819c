//! What the stage hands on.

use afmid_pipeline::{Document, StageError, Table};
use serde_json::{Value, json};

use afmid_kernels::contact::{ContactResonance, FreeLever, JointContact};

pub(super) fn contact_table(contact: &JointContact) -> Table {
    let column = |value: fn(&ContactResonance) -> f64| contact.resonances.iter().map(value).collect::<Vec<f64>>();
    Table::new()
        .with("frequency_hz", "Hz", "coupled resonance as measured", column(|r| r.measured.frequency_hz.value))
        .with("frequency_std_hz", "Hz", "its standard error", column(|r| r.measured.frequency_hz.std))
        .with("quality_factor", "1", "its quality factor", column(|r| r.measured.quality_factor.value))
        .with("quality_factor_std", "1", "its standard error", column(|r| r.measured.quality_factor.std))
        .with(
            "fitted_hz",
            "Hz",
            "contact resonance from everything together",
            column(|r| r.estimated.frequency_hz.value),
        )
        .with("fitted_std_hz", "Hz", "its standard error", column(|r| r.estimated.frequency_hz.std))
        .with("fitted_quality_factor", "1", "its quality factor", column(|r| r.estimated.quality_factor.value))
        .with("fitted_quality_factor_std", "1", "its standard error", column(|r| r.estimated.quality_factor.std))
        .with(
            "stiffness",
            "N/m",
            "contact stiffness from this pole alone, as of a spring and damper, shares as estimated",
            column(|r| r.alone.stiffness_n_per_m.value),
        )
        .with("stiffness_std", "N/m", "its standard error", column(|r| r.alone.stiffness_n_per_m.std))
        .with("damping", "N s/m", "contact damping from this pole alone", column(|r| r.alone.damping_n_s_per_m.value))
        .with("damping_std", "N s/m", "its standard error", column(|r| r.alone.damping_n_s_per_m.std))
        .with(
            "stiffness_weight",
            "1",
            "what pole and residue count in the stiffness",
            column(|r| r.alone.stiffness_weight),
        )
        .with("damping_weight", "1", "what they count in the damping", column(|r| r.alone.damping_weight))
}

pub(super) fn share_table(contact: &JointContact, lever: &FreeLever, given: &[f64]) -> Table {
    let shares = &contact.tip_shares;
    Table::new()
        .with(
            "frequency_hz",
            "Hz",
            "free mode",
            lever.modes().iter().map(|m| m.frequency_hz.value).collect::<Vec<f64>>(),
        )
        .with(
            "tip_share",
            "1",
            "what it has of the tip's static compliance",
            shares.iter().map(|s| s.value).collect::<Vec<f64>>(),
        )
        .with(
            "tip_share_std",
            "1",
            "its standard error; 0 if given",
            shares.iter().map(|s| s.std).collect::<Vec<f64>>(),
        )
        .with("given", "1", "the share as given", given.to_vec())
}

/// JSON has no NaN: unknown is null.
fn known(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

pub(super) fn summary(contact: &JointContact, lever: &FreeLever) -> Result<Document, StageError> {
    let resonances = contact.resonances.iter().map(|r| {
        json!({
            "frequency_hz": known(r.estimated.frequency_hz.value),
            "frequency_std_hz": known(r.estimated.frequency_hz.std),
            "quality_factor": known(r.estimated.quality_factor.value),
            "quality_factor_std": known(r.estimated.quality_factor.std),
            "stiffness_weight": known(r.alone.stiffness_weight),
            "damping_weight": known(r.alone.damping_weight),
        })
    });
    let shares = contact.tip_shares.iter().map(|s| json!({ "tip_share": s.value, "tip_share_std": known(s.std) }));
    Document::new(&json!({
        "contact_stiffness_n_per_m": contact.stiffness_n_per_m.value,
        "contact_stiffness_std_n_per_m": known(contact.stiffness_n_per_m.std),
        "contact_damping_n_s_per_m": contact.damping_n_s_per_m.value,
        "contact_damping_std_n_s_per_m": known(contact.damping_n_s_per_m.std),
        "contact_inertia_kg": contact.inertia_kg.map(|e| e.value),
        "contact_inertia_std_kg": contact.inertia_kg.map(|e| e.std),
        "law": if contact.inertia_kg.is_some() { "second-order" } else { "spring-damper" },
        "law_gain": contact.law_gain,
        "correlation": known(contact.correlation),
        "lever_stiffness_n_per_m": lever.stiffness().value,
        "chi_square": contact.chi_square,
        "freedom": contact.freedom,
        "p_value": known(contact.p_value),
        "residues": contact.residues.map(|test| json!({
            "used": test.used,
            "chi_square": test.chi_square,
            "freedom": test.freedom,
            "p_value": known(test.p_value),
        })),
        "stiffness_std_by_origin_n_per_m": {
            "coupled_ringing": contact.budget.coupled,
            "free_ringing": contact.budget.free,
            "given_shares": contact.budget.given,
            "lever_stiffness": contact.budget.stiffness,
        },
        "tip_shares": shares.collect::<Vec<Value>>(),
        "resonances": resonances.collect::<Vec<Value>>(),
    }))
}
