//! The story of a diagnosis as artifacts.

use afmid_pipeline::{Array, Axis, Table};

use afmid_kernels::diagnosis::verdict::Diagnosis;
use afmid_kernels::diagnosis::{Binned, Story};

/// Errors by frequency and by the output's size.
pub(super) fn error_array(story: &Story, unit: &str) -> Array {
    let density = format!("{unit}^2/Hz");
    let of = |pick: fn(&Binned) -> f64| story.sizes.iter().map(pick).collect::<Vec<f64>>();
    let (f, s) = (&["frequency"], &["output"]);
    Array::over(vec![
        Axis::new("frequency", "Hz", "frequency", story.spectra.frequency_hz.clone()),
        Axis::new("output", unit, "output", of(|bin| bin.at)),
    ])
    .with("spectrum_output", &density, "density of the output, one-sided", f, story.spectra.output.clone())
    .with("spectrum_before", &density, "density of the linear model's error", f, story.spectra.before.clone())
    .with("spectrum_after", &density, "density of the extended model's error", f, story.spectra.after.clone())
    .with("rms_before", unit, "rms error of the linear model where the output is so large", s, of(|bin| bin.before))
    .with("rms_after", unit, "rms error of the extended model there", s, of(|bin| bin.after))
}

/// Errors over time, part by part.
pub(super) fn error_table(story: &Story, unit: &str) -> Table {
    let rows: Vec<(&String, &Binned)> =
        story.times.iter().flat_map(|(part, bins)| bins.iter().map(move |bin| (part, bin))).collect();
    Table::of(&rows)
        .with("part", "", "part of the record", |(part, _)| (*part).clone())
        .with("time_s", "s", "time since the first sample of the record", |(_, bin)| bin.at)
        .with("output", unit, "rms of the output", |(_, bin)| bin.output)
        .with("before", unit, "rms error of the linear model", |(_, bin)| bin.before)
        .with("after", unit, "rms error of the extended model", |(_, bin)| bin.after)
        .table()
}

/// Models, each with one more cause.
pub(super) fn ladder(found: &Diagnosis) -> Table {
    let rungs = &found.ladder;
    let unit = &rungs.first().map_or(String::new(), |rung| rung.unit.clone());
    let known = |value: Option<f64>| value.unwrap_or(f64::NAN);
    Table::of(rungs)
        .with("added", "1", "what was added", |rung| rung.added.clone())
        .with("parameters", "1", "parameters so far", |rung| rung.parameters as f64)
        .with("rms", unit, "free-run error of the identification stretch", |rung| known(rung.rms))
        .with("held_out_rms", unit, "free-run error of what was held out", |rung| known(rung.held_out_rms))
        .with("log_likelihood_gain", "1", "over the model before", |rung| known(rung.log_likelihood_gain))
        .with("bic", "1", "Bayesian information criterion", |rung| known(rung.bic))
        .table()
}
