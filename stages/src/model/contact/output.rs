//! What the stage hands on.

use afmid_pipeline::{Document, StageError, Table};
use serde_json::{Value, json};

use afmid_kernels::contact::{FreeLever, JointContact};

pub(super) fn contact_table(contact: &JointContact) -> Table {
    let fitted = "contact resonance from everything together";
    let stiffness = "contact stiffness from this pole alone, as of a spring and damper, shares as estimated";
    let weight = "what pole and residue count in the stiffness";
    Table::of(&contact.resonances)
        .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "coupled resonance as measured", |r| {
            r.measured.frequency_hz
        })
        .with_std(["quality_factor", "quality_factor_std"], "1", "its quality factor", |r| r.measured.quality_factor)
        .with_std(["fitted_hz", "fitted_std_hz"], "Hz", fitted, |r| r.estimated.frequency_hz)
        .with_std(["fitted_quality_factor", "fitted_quality_factor_std"], "1", "its quality factor", |r| {
            r.estimated.quality_factor
        })
        .with_std(["stiffness", "stiffness_std"], "N/m", stiffness, |r| r.alone.stiffness_n_per_m)
        .with_std(["damping", "damping_std"], "N s/m", "contact damping from this pole alone", |r| {
            r.alone.damping_n_s_per_m
        })
        .with("stiffness_weight", "1", weight, |r| r.alone.stiffness_weight)
        .with("damping_weight", "1", "what they count in the damping", |r| r.alone.damping_weight)
        .table()
}

pub(super) fn share_table(contact: &JointContact, lever: &FreeLever, given: &[f64]) -> Table {
    let share = "what it has of the tip's static compliance";
    let frequencies: Vec<f64> = lever.modes().iter().map(|mode| mode.frequency_hz.value).collect();
    Table::new()
        .with("frequency_hz", "Hz", "free mode", frequencies)
        .with("tip_share", "1", share, contact.tip_shares.iter().map(|s| s.value).collect::<Vec<f64>>())
        .with(
            "tip_share_std",
            "1",
            "its standard error; 0 if given",
            contact.tip_shares.iter().map(|s| s.std).collect::<Vec<f64>>(),
        )
        .with("given", "1", "the share as given", given.to_vec())
}

/// The contact as JSON, where NaN, which is unknown, becomes null.
pub(super) fn summary(contact: &JointContact, lever: &FreeLever) -> Result<Document, StageError> {
    let resonances = contact.resonances.iter().map(|r| {
        json!({
            "frequency_hz": r.estimated.frequency_hz.value,
            "frequency_std_hz": r.estimated.frequency_hz.std,
            "quality_factor": r.estimated.quality_factor.value,
            "quality_factor_std": r.estimated.quality_factor.std,
            "stiffness_weight": r.alone.stiffness_weight,
            "damping_weight": r.alone.damping_weight,
        })
    });
    let shares = contact.tip_shares.iter().map(|s| json!({ "tip_share": s.value, "tip_share_std": s.std }));
    Document::new(&json!({
        "contact_stiffness_n_per_m": contact.stiffness_n_per_m.value,
        "contact_stiffness_std_n_per_m": contact.stiffness_n_per_m.std,
        "contact_damping_n_s_per_m": contact.damping_n_s_per_m.value,
        "contact_damping_std_n_s_per_m": contact.damping_n_s_per_m.std,
        "contact_inertia_kg": contact.inertia_kg.map(|e| e.value),
        "contact_inertia_std_kg": contact.inertia_kg.map(|e| e.std),
        "law": if contact.inertia_kg.is_some() { "second-order" } else { "spring-damper" },
        "law_gain": contact.law_gain,
        "correlation": contact.correlation,
        "lever_stiffness_n_per_m": lever.stiffness().value,
        "chi_square": contact.chi_square,
        "freedom": contact.freedom,
        "p_value": contact.p_value,
        "residues": contact.residues.map(|test| json!({
            "used": test.used,
            "chi_square": test.chi_square,
            "freedom": test.freedom,
            "p_value": test.p_value,
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
