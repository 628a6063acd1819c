//! The example of `io.columns`: it writes a small table and reads it.

use std::path::Path;

use afmid_pipeline::{Example, Ports, StageError};

use super::stage::{PAIR, SUMMARY};

/// An example's parameters are fixed text, so its folder is too.
const FOLDER: &str = "/tmp/afmid-example-columns";

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "a table with a header and a missing output, split in half",
        params: "file = \"/tmp/afmid-example-columns/beam.csv\"\ninputs = [\"u\"]\noutput = \"y\"\ntime = \"t\"\nmissing = [-9999]",
        inputs: write_table,
        expect,
    }]
}

fn output(k: usize) -> f64 {
    if k == 70 { -9999.0 } else { (k % 10) as f64 + 100.0 * f64::from(k >= 50) }
}

fn write_table() -> Result<Ports, StageError> {
    std::fs::create_dir_all(FOLDER).map_err(|error| StageError::from_error(error).at(FOLDER))?;
    let rows: String = (0..100).map(|k| format!("{},{},{}\n", k as f64 * 0.02, k % 4, output(k))).collect();
    // written whole under another name, then renamed: examples may run at the same time
    let (path, partial) =
        (Path::new(FOLDER).join("beam.csv"), format!("{FOLDER}/{:?}.tmp", std::thread::current().id()));
    std::fs::write(&partial, format!("# a beam\nt,u,y\n{rows}"))
        .and_then(|()| std::fs::rename(&partial, path))
        .map_err(|error| StageError::from_error(error).at(FOLDER))?;
    Ok(Ports::new())
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let text = |error: StageError| error.to_string();
    let pair = outputs.get(&PAIR).map_err(text)?;
    let rate = pair.number("sample_rate_hz").map_err(text)?;
    let (y, u) = (pair.real("response_verification").map_err(text)?, pair.real("force_identification").map_err(text)?);
    let removed = outputs.get(&SUMMARY).map_err(text)?.0["removed"]["output"]["level"].as_f64();
    // 4.5 is the first half's mean; the second half keeps its own level of 100 above it
    let right = (rate - 50.0).abs() < 1e-9 && removed == Some(4.5) && y[1] == 96.5 && y[20].is_nan() && u.len() == 50;
    match right {
        true => Ok("50 samples each at 50 Hz; 4.5 taken off the output; sample 70 missing".to_owned()),
        false => Err(format!("rate {rate}, removed {removed:?}, {:?}", &y[..2])),
    }
}
