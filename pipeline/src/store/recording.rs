//! Recordings: names, places, sizes and hashes of record files, never their samples and never HDF5 links.

use std::path::PathBuf;
use std::sync::Arc;

use hdf5::Group;

use super::table::{read_table, write_table};
use crate::artifact::Table;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::write;
use crate::recording::{Channel, InputFiles, LazySource, Reading, Record, Recording};

/// Writes a recording as the group `name` with the tables `records` and `channels`.
pub(super) fn write_recording(parent: &Group, name: &str, recording: &Recording) -> Result<Group> {
    let group = write::nexus_group(parent, name, "NXcollection")?;
    let records = &recording.records;
    let each = |of: fn(&Record) -> String| records.iter().map(of).collect::<Vec<String>>();
    let files = Table::new()
        .with("file", "", "file name", each(|record| record.name.clone()))
        .with("path", "", "where it lay", each(|record| record.path.to_string_lossy().into_owned()))
        .with("size", "B", "size of the file", records.iter().map(|record| record.size as i64).collect::<Vec<_>>())
        .with("blake3", "", "BLAKE3 hash of its bytes", each(|record| record.blake3.clone()))
        .with(
            "sample_rate",
            "Hz",
            "sample rate",
            records.iter().map(|record| record.sample_rate_hz).collect::<Vec<_>>(),
        )
        .with("started_at", "", "start of the acquisition", each(|record| record.started_at.clone()))
        .with(
            "first_sample",
            "1",
            "sample of the file's channels that is the record's first",
            records.iter().map(|record| record.first_sample as i64).collect::<Vec<_>>(),
        )
        .with("reading", "", "which reader opens the file, JSON", readings(records)?);
    let files = match records.iter().any(|record| record.rate_relative_std > 0.0) {
        false => files,
        true => files.with(RATE_STD, "1", "standard error of the sample rate, relative", rate_stds(records)),
    };
    write_table(&group, "records", &files)?;
    let rows: Vec<(i64, &Channel)> = (0..)
        .zip(records)
        .flat_map(|(index, record)| record.channels.iter().map(move |channel| (index, channel)))
        .collect();
    let text = |of: fn(&Channel) -> &str| rows.iter().map(|(_, channel)| of(channel).to_owned()).collect::<Vec<_>>();
    let real = |of: fn(&Channel) -> f64| rows.iter().map(|(_, channel)| of(channel)).collect::<Vec<_>>();
    let channels = Table::new()
        .with("record", "1", "row of its record", rows.iter().map(|(index, _)| *index).collect::<Vec<i64>>())
        .with("role", "", "what it is to the stages", text(|channel| &channel.role))
        .with("location", "", "where it lies in the file", text(|channel| &channel.location))
        .with("samples", "1", "samples", rows.iter().map(|(_, channel)| channel.samples as i64).collect::<Vec<i64>>())
        .with("unit", "", "unit of the values", text(|channel| &channel.unit))
        .with("description", "", "what it is", text(|channel| &channel.long_name))
        .with("scale_factor", "1", "value per stored unit", real(|channel| channel.scale_factor))
        .with("add_offset", "1", "value at stored zero", real(|channel| channel.add_offset))
        .with(
            "has_fill_code",
            "",
            "whether a code marks missing samples",
            rows.iter().map(|(_, channel)| channel.fill_code.is_some()).collect::<Vec<_>>(),
        )
        .with(
            "fill_code",
            "1",
            "stored code of missing samples",
            real(|channel| channel.fill_code.unwrap_or(f64::NAN)),
        );
    write_table(&group, "channels", &channels)?;
    Ok(group)
}

/// The column with the standard errors of rates, in recordings where one is not 0.
const RATE_STD: &str = "sample_rate_relative_std";

fn rate_stds(records: &[Record]) -> Vec<f64> {
    records.iter().map(|record| record.rate_relative_std).collect()
}

/// Which reader opens each file, in JSON.
fn readings(records: &[Record]) -> Result<Vec<String>> {
    let text = |record: &Record| serde_json::to_string(&record.reading);
    records
        .iter()
        .map(text)
        .collect::<std::result::Result<_, _>>()
        .map_err(|error| StoreError::new(format!("how a record is read cannot be written as JSON: {error}")))
}

fn reading(json: &str) -> std::result::Result<Reading, crate::StageError> {
    serde_json::from_str(json).map_err(|error| crate::StageError::new(format!("found {json} as `reading`: {error}")))
}

/// Reads what [`write_recording`] wrote; the samples are looked for in the record files when they are asked for.
pub(super) fn read_recording(group: &Node, input_files: &InputFiles) -> Result<Recording> {
    let files = read_table(&crate::hdf5_files::read::group(group, "records")?)?;
    let channels = read_table(&crate::hdf5_files::read::group(group, "channels")?)?;
    let wrap = |error: crate::StageError| StoreError::new(error.to_string()).at(group.name());
    let mut records = Vec::with_capacity(files.rows());
    let columns = (files.text("file").map_err(wrap)?, files.text("path").map_err(wrap)?);
    let (hashes, starts) = (files.text("blake3").map_err(wrap)?, files.text("started_at").map_err(wrap)?);
    let (sizes, rates) = (files.integer("size").map_err(wrap)?, files.real("sample_rate").map_err(wrap)?);
    for (((name, path), (blake3, started_at)), (&size, &sample_rate_hz)) in
        columns.0.iter().zip(columns.1).zip(hashes.iter().zip(starts)).zip(sizes.iter().zip(rates))
    {
        records.push(Record {
            name: name.clone(),
            path: PathBuf::from(path),
            size: size as u64,
            blake3: blake3.clone(),
            sample_rate_hz,
            started_at: started_at.clone(),
            rate_relative_std: 0.0,
            first_sample: 0,
            reading: Reading::default(),
            channels: Vec::new(),
        });
    }
    let (firsts, readings) = (files.integer("first_sample").map_err(wrap)?, files.text("reading").map_err(wrap)?);
    for (record, (&first, json)) in records.iter_mut().zip(firsts.iter().zip(readings)) {
        let negative = |_| StoreError::new(format!("found {first} as `first_sample`")).at(group.name());
        record.first_sample = usize::try_from(first).map_err(negative)?;
        record.reading = reading(json).map_err(wrap)?;
    }
    if files.columns.iter().any(|column| column.name == RATE_STD) {
        let stds = files.real(RATE_STD).map_err(wrap)?;
        records.iter_mut().zip(stds).for_each(|(record, std)| record.rate_relative_std = *std);
    }
    for row in 0..channels.rows() {
        let (index, channel) = read_channel(input_files, &channels, row, &records).map_err(wrap)?;
        if let Some(record) = records.get_mut(index) {
            record.channels.push(channel);
        }
    }
    Ok(Recording { records })
}

fn read_channel(
    input_files: &InputFiles,
    table: &Table,
    row: usize,
    records: &[Record],
) -> std::result::Result<(usize, Channel), crate::StageError> {
    let text = |name: &str| table.text(name).map(|values| values.get(row).cloned().unwrap_or_default());
    let real = |name: &str| table.real(name).map(|values| values.get(row).copied().unwrap_or(f64::NAN));
    let whole = |name: &str| -> std::result::Result<usize, crate::StageError> {
        let value = table.integer(name)?.get(row).copied().unwrap_or(-1);
        usize::try_from(value).map_err(|_| crate::StageError::new(format!("channel {row}: `{name}` is {value}")))
    };
    let index = whole("record")?;
    let record = records
        .get(index)
        .ok_or_else(|| crate::StageError::new(format!("channel {row} belongs to record {index}, which is missing")))?;
    let (role, location, samples) = (text("role")?, text("location")?, whole("samples")?);
    let source = LazySource::new(input_files, &record.path, (record.size, &record.blake3), &location, samples);
    let source = source.of_stretch(record.first_sample, &record.reading);
    let has_fill_code = table.flag("has_fill_code")?.get(row) == Some(&true);
    let channel = Channel {
        role,
        samples,
        unit: text("unit")?,
        long_name: text("description")?,
        scale_factor: real("scale_factor")?,
        add_offset: real("add_offset")?,
        fill_code: has_fill_code.then(|| real("fill_code")).transpose()?,
        source: Arc::new(source),
        location,
    };
    Ok((index, channel))
}
