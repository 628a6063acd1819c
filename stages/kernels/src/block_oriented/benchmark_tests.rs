//! The Wiener-Hammerstein benchmark: an electronic circuit of two third-order filters with a diode between them.

use std::path::{Path, PathBuf};

use afmid_formats::Format;
use afmid_formats::readers::matlab::Mat;

use super::*;
use crate::monitor::Unwatched;

/// Input and output; none where the file is not there.
fn records() -> Option<[Vec<f64>; 2]> {
    let root = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let path = root.join("wiener-hammerstein/WienerHammerBenchMark.mat");
    let channels = path.exists().then(|| Mat::open(&path).unwrap().channels)?;
    Some(["uBenchMark", "yBenchMark"].map(|name| {
        let found = channels.iter().find(|channel| channel.location.contains(name)).unwrap();
        let mut values = Vec::new();
        let raw = found.source.read(0, found.samples).unwrap();
        raw.scale_into(found.scale_factor, found.add_offset, &mut values);
        values
    }))
}

#[test]
fn the_benchmark_circuit_is_simulated_to_a_thousandth_of_its_output() {
    let Some([u, y]) = records() else {
        println!("left out: 1 record, ../shared/data/wiener-hammerstein is not there");
        return;
    };
    let options = BlockOptions { transient: 1000, ..BlockOptions::default() };
    let fit = fit_block_oriented(&u[5200..105_200], &y[5200..105_200], &options, &Unwatched).unwrap();
    let simulated = fit.model.simulate(&u[105_200..184_000]);
    let square = |(s, y): (&f64, &f64)| (s - y) * (s - y);
    let sum: f64 = simulated.iter().zip(&y[105_200..184_000]).skip(1000).map(square).sum();
    let rms_mv = 1e3 * (sum / 77_800.0).sqrt();
    println!("{rms_mv:.4} mV, training {:.4} mV, linear {:.2} mV", 1e3 * fit.training_rms, 1e3 * fit.linear_rms);
    assert_eq!(fit.structure, Structure::WienerHammerstein);
    // the output's standard deviation is 244 mV, a linear model leaves 43; 0.27 is reached
    assert!(rms_mv < 0.3, "{rms_mv} mV");
    let bend = fit.curve_strength();
    assert!(bend.relative > 10.0 * bend.std, "{bend:?}");
}
