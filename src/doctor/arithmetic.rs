//! Stages on known truth: their own examples, run here.

use std::time::Instant;

use afmid_pipeline::Registry;
use afmid_pipeline::conformance::examples_hold;

use super::Finding;

/// From samples to modes: FFT, dense linear algebra, both fits.
const STAGES: [&str; 4] = ["spectrum.etfe", "model.subspace", "model.pem", "model.ringdown"];

/// Runs the examples of some stages and compares with their truth.
pub fn examples(registry: &Registry) -> Vec<Finding> {
    let known = STAGES.iter().filter_map(|&name| Some((name, registry.find(name)?)));
    known
        .map(|(name, entry)| {
            let clock = Instant::now();
            let wrong = examples_hold(entry);
            if wrong.is_empty() {
                return Finding::good(
                    name,
                    format!("finds its examples' truth, {:.2} s", clock.elapsed().as_secs_f64()),
                );
            }
            let help = "this build computes wrong numbers here: build again with `cargo build --release --locked`, and \
                report it";
            Finding::bad(name, wrong.join("; "), help)
        })
        .collect()
}

#[cfg(test)]
#[test]
fn the_stages_are_there_and_find_their_truth() {
    let registry = crate::registry().expect("stages");
    let findings = examples(&registry);
    assert_eq!(findings.len(), STAGES.len());
    assert!(findings.iter().all(|finding| finding.help.is_none()), "{findings:?}");
}
