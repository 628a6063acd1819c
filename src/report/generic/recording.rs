//! Recordings as a list of records.

use afmid_pipeline::Recording;

use super::ROWS;
use crate::report::number::{bytes, integer, quantity};
use crate::report::view::{ArtifactView, Fact, Head, TableView};

pub(super) fn recording_view(recording: &Recording) -> ArtifactView {
    let heads = vec![
        Head::text("record"),
        Head::number("samples", ""),
        Head::number("sample rate", ""),
        Head::text("started at"),
        Head::text("channels"),
        Head::number("size", ""),
    ];
    let mut table = TableView::new("Records", heads);
    for record in recording.records.iter().take(ROWS) {
        // as the file names them; what part each plays, the parameters say
        let channels: Vec<String> =
            record.channels.iter().map(|channel| format!("{} ({})", channel.location, channel.unit)).collect();
        let samples = record.channels.iter().map(|channel| channel.samples).max().unwrap_or(0);
        table.rows.push(vec![
            record.name.clone(),
            integer(i64::try_from(samples).unwrap_or(i64::MAX)),
            quantity(record.sample_rate_hz, f64::NAN, "Hz"),
            record.started_at.clone(),
            channels.join(", "),
            bytes(record.size),
        ]);
    }
    let total = recording.file_bytes();
    ArtifactView {
        facts: vec![Fact::new("records", recording.records.len().to_string()), Fact::new("size", bytes(total))],
        tables: vec![table.truncated(ROWS, recording.records.len())],
        ..ArtifactView::default()
    }
}
