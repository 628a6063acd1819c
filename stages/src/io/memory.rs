//! Records that lie in memory: for examples, tests, and stages that make their own.

use std::path::PathBuf;
use std::sync::Arc;

use afmid_pipeline::recording::{FormatError, Raw, Reading};
use afmid_pipeline::{Channel, Record, Source};

/// Samples in memory as a source.
#[derive(Debug, Clone, PartialEq)]
pub struct MemorySource(pub Raw);

impl Source for MemorySource {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = start.checked_add(count).filter(|&end| end <= self.0.len()).ok_or_else(|| {
            let there = self.0.len();
            FormatError::new(format!("samples {start} to {start} + {count} asked for, there are {there}"), "")
        })?;
        Ok(match &self.0 {
            Raw::Int16(codes) => Raw::Int16(codes[start..end].to_vec()),
            Raw::Int32(codes) => Raw::Int32(codes[start..end].to_vec()),
            Raw::Float32(values) => Raw::Float32(values[start..end].to_vec()),
            Raw::Float64(values) => Raw::Float64(values[start..end].to_vec()),
        })
    }
}

/// A channel in volts, of codes worth `scale_factor` each.
pub fn memory_channel(role: &str, raw: Raw, scale_factor: f64) -> Channel {
    Channel {
        role: role.to_owned(),
        location: format!("/{role}"),
        samples: raw.len(),
        unit: "V".to_owned(),
        long_name: String::new(),
        scale_factor,
        add_offset: 0.0,
        fill_code: None,
        source: Arc::new(MemorySource(raw)),
    }
}

/// A record of such channels.
pub fn memory_record(name: &str, sample_rate_hz: f64, channels: Vec<Channel>) -> Record {
    Record {
        name: name.to_owned(),
        path: PathBuf::from(name),
        size: 0,
        blake3: String::new(),
        sample_rate_hz,
        started_at: String::new(),
        rate_relative_std: 0.0,
        first_sample: 0,
        reading: Reading::default(),
        channels,
    }
}
