//! Prints what a file holds: for comparing with other readers.

use common::{Contents, Format, FormatError, Raw};
use std::path::Path;

fn open(path: &Path) -> Result<Contents, FormatError> {
    let all = std::fs::read(path).unwrap_or_default();
    let head = all.get(..all.len().min(4096)).unwrap_or_default();
    if daq::tdms::Tdms::recognises(head, path) {
        daq::tdms::Tdms::open(path)
    } else if daq::uff::Uff::recognises(head, path) {
        daq::uff::Uff::open(path)
    } else {
        daq::text_table::TextTable::open(path)
    }
}

fn main() {
    for name in std::env::args().skip(1) {
        println!("== {name}");
        match open(Path::new(&name)) {
            Err(error) => println!("{error:?}"),
            Ok(contents) => {
                println!("{} | {}", contents.format, contents.started_at);
                for c in &contents.channels {
                    let values: Vec<f64> = match c.source.read(0, c.samples) {
                        Ok(Raw::Int16(v)) => v.into_iter().map(f64::from).collect(),
                        Ok(Raw::Int32(v)) => v.into_iter().map(f64::from).collect(),
                        Ok(Raw::Float32(v)) => v.into_iter().map(f64::from).collect(),
                        Ok(Raw::Float64(v)) => v,
                        Err(error) => {
                            println!("{}: {error:?}", c.location);
                            continue;
                        }
                    };
                    let values: Vec<f64> = values.iter().map(|v| v * c.scale_factor + c.add_offset).collect();
                    let (first, last) = (values.first(), values.last());
                    let sum: f64 = values.iter().sum();
                    let unit = &c.unit;
                    let rate = c.sample_rate_hz;
                    println!(
                        "{} [{unit}] n={} sum={sum:?} first={first:?} last={last:?} rate={rate:?} gaps={:?} {}",
                        c.location, c.samples, c.gaps, c.stored_as
                    );
                }
                for remark in &contents.remarks {
                    println!("  - {remark}");
                }
            }
        }
    }
}
