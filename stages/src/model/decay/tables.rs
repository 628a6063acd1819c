//! What the stage hands on.

use afmid_pipeline::{Array, Axis, Document, StageError, Table};
use serde_json::{Value, json};

use super::course::{Parts, dropped_document};
use super::systems::Systems;
use crate::artifacts::{Decays, SAMPLE_RATE_HZ, mode_table, shaped_mode};
use afmid_kernels::ringdown::{ChannelRingdown, FollowedDecay, ModeEstimate, ModeShape, RingdownNoise};

/// The modes, and how much more than noise the fit leaves round each.
pub(super) fn modes_with_lack(fit: &ChannelRingdown) -> Table {
    let what = "factor of the variances for what the fit leaves round the mode; 1: noise";
    mode_table(&fit.modes()).with("lack_of_fit", "1", what, fit.lack_of_fit.clone())
}

/// A mode in a hit.
struct HitRow<'a> {
    hit: usize,
    mode: usize,
    shape: &'a ModeShape,
}

/// Amplitude and phase of each mode in each hit, at the channel that its shape is relative to.
pub(super) fn hit_table(fit: &ChannelRingdown, decays: &Decays<'_>) -> Table {
    let row = |(mode, shape): (usize, &'_ ModeShape)| (0..shape.amplitudes.len()).map(move |hit| (hit, mode));
    let mut rows: Vec<HitRow> = fit
        .shapes
        .iter()
        .enumerate()
        .flat_map(|(mode, shape)| row((mode, shape)).map(move |(hit, mode)| HitRow { hit, mode, shape }))
        .collect();
    rows.sort_by_key(|row| (row.hit, row.mode));
    Table::of(&rows)
        .with("hit", "1", "number of the hit", |row| decays.numbers.get(row.hit).map_or(0, |number| number + 1))
        .with("mode", "1", "number of the mode", |row| row.mode + 1)
        .with("channel", "1", "channel of its largest amplitude", |row| row.shape.reference + 1)
        .with("amplitude", "", "amplitude there at the first free sample, in its unit", |row| {
            row.shape.amplitudes[row.hit].norm()
        })
        .with("phase", "rad", "phase there", |row| row.shape.amplitudes[row.hit].arg())
        .table()
}

/// The hit with the largest first sample's ringing, as measured and as fitted, in every channel.
pub(super) fn fit_array(followed: &FollowedDecay, decays: &Decays<'_>) -> Array {
    let fit = &followed.fitted;
    let size = |hit: usize| {
        let own = fit.records.iter().filter(|record| record.event == hit);
        own.flat_map(|record| &record.residues).map(|residue| residue.norm_sqr()).sum::<f64>()
    };
    let hits = fit.records.iter().map(|record| record.event + 1).max().unwrap_or(0);
    let largest = (0..hits).max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let hit = decays.hits.get(largest);
    let rows: Vec<&[f64]> = hit.map(|hit| hit.iter().map(|row| &row[..]).collect()).unwrap_or_default();
    let samples = rows.first().map_or(0, |row| row.len());
    let measured: Vec<f64> = rows.iter().flat_map(|row| row.iter().copied()).collect();
    let own = fit.records.iter().filter(|record| record.event == largest);
    let linear: Vec<f64> = own.flat_map(|record| fit.signal(record, 1.0 / decays.sample_rate_hz, samples)).collect();
    let rest: Vec<f64> = match followed.residuals.get(largest) {
        Some(rows) => rows.iter().flatten().copied().collect(),
        None => measured.iter().zip(&linear).map(|(y, m)| y - m).collect(),
    };
    let fitted: Vec<f64> = measured.iter().zip(&rest).map(|(y, left)| y - left).collect();
    let unit = decays.sensors.first().map_or("", |sensor| &sensor.unit);
    let over = &["channel", "time"];
    Array::over(vec![
        Axis::new("channel", "1", "number of the channel", (1..=rows.len()).map(|k| k as f64).collect()),
        Axis::new(
            "time",
            "s",
            "time since the first free sample",
            (0..samples).map(|k| k as f64 / decays.sample_rate_hz).collect(),
        ),
    ])
    .with("measured", unit, "free decay of the largest hit", over, measured)
    .with("fitted", unit, "the same as fitted", over, fitted)
    .with("residual", unit, "what is left", over, rest)
    .attribute("hit", decays.numbers.get(largest).map_or(0, |number| number + 1))
    .attribute(SAMPLE_RATE_HZ, decays.sample_rate_hz)
}

/// The contract of `show --json`, and what does not fit.
pub(super) fn summary(
    followed: &FollowedDecay,
    parts: &Parts<'_>,
    systems: &Systems,
    decays: &Decays<'_>,
) -> Result<Document, StageError> {
    let fit = &followed.fit;
    let modes = fit.modes();
    let channels: Vec<&str> = decays.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    let mode = |(mode, shape): (&ModeEstimate, &ModeShape)| shaped_mode(mode, shape, &channels);
    let noise = |noise: &RingdownNoise| {
        json!({
            "white_std": noise.white.sqrt(),
            "wander_std": noise.wander.iter().fold(0.0, |sum, part| sum + part.variance).sqrt(),
        })
    };
    Document::new(&json!({
        "modes": modes.iter().zip(&fit.shapes).map(mode).collect::<Vec<Value>>(),
        "hits": decays.hits.len(),
        "systems": systems.document(),
        "channels": decays.sensors,
        "converged": fit.verdict.converged,
        "noise": fit.noise.iter().map(noise).collect::<Vec<Value>>(),
        "lack_of_fit": fit.lack_of_fit,
        "course": parts.document(),
        "dropped": dropped_document(&followed.dropped),
        "tried": fit.seen.iter().map(|seen| json!({ "modes": seen.modes, "gain": seen.gain, "kept": seen.kept }))
            .collect::<Vec<Value>>(),
    }))
}
