//! Time series of NWB.

use hdf5::types::VarLenUnicode;
use hdf5::{Group, Location};
use ndarray::{Array1, Array2};

use super::super::{InputFiles, Reading, open_contents};
use crate::files::fixture::Folder;
use afmid_formats::{Contents, FoundChannel};

fn number(owner: &Location, name: &str, value: f64) {
    owner.new_attr::<f64>().create(name).unwrap().write_scalar(&value).unwrap();
}

fn text(owner: &Location, name: &str, value: &str) {
    let value: VarLenUnicode = value.parse().unwrap();
    owner.new_attr::<VarLenUnicode>().create(name).unwrap().write_scalar(&value).unwrap();
}

/// What is read of a file that `fill` makes.
fn opened(name: &str, fill: impl FnOnce(&hdf5::File)) -> Contents {
    let folder = Folder::new(name);
    let path = folder.file("made.h5");
    let file = hdf5::File::create(&path).unwrap();
    fill(&file);
    file.close().unwrap();
    let mut contents = open_contents(&InputFiles::new(), &path, &Reading::of("auto", None)).unwrap().1;
    for channel in &mut contents.channels {
        // the folder goes
        channel.source = std::sync::Arc::new(Kept(channel.source.read(0, channel.samples).unwrap()));
    }
    contents
}

#[derive(Debug)]
struct Kept(afmid_formats::Raw);

impl afmid_formats::Source for Kept {
    fn read(&self, _: usize, _: usize) -> Result<afmid_formats::Raw, afmid_formats::FormatError> {
        Ok(self.0.clone())
    }
}

fn values(channel: &FoundChannel) -> Vec<f64> {
    let mut values = Vec::new();
    let raw = channel.source.read(0, channel.samples).unwrap();
    raw.scale_into(channel.scale_factor, channel.add_offset, &mut values);
    values
}

fn says(contents: &Contents, words: &str) -> bool {
    contents.remarks.iter().any(|remark| remark.contains(words))
}

/// A group with `starting_time`.
fn series(file: &hdf5::File, path: &str, kind: &str, clock_unit: &str) -> Group {
    let group = file.create_group(path).unwrap();
    text(&group, "neurodata_type", kind);
    let clock = group.new_dataset::<f64>().create("starting_time").unwrap();
    clock.write_scalar(&2.5).unwrap();
    clock.new_attr::<f32>().create("rate").unwrap().write_scalar(&5000.0_f32).unwrap();
    text(&clock, "unit", clock_unit);
    group
}

#[test]
fn nwb_states_rate_scale_and_unit_and_its_first_axis_is_time() {
    let codes = Array1::from_shape_fn(50, |sample| sample as i16 * 16 - 100);
    let contents = opened("nwb", |file| {
        let group = series(file, "acquisition/acc", "TimeSeries", "seconds");
        let data = group.new_dataset_builder().with_data(&codes).create("data").unwrap();
        number(&data, "conversion", 1.0 / 16.0);
        number(&data, "offset", 0.5);
        text(&data, "unit", "volts");
        let group = series(file, "acquisition/array", "ElectricalSeries", "seconds");
        let wide = Array2::from_shape_fn((3, 60), |(sample, channel)| (100 * sample + channel) as i16);
        let data = group.new_dataset_builder().with_data(&wide).create("data").unwrap();
        number(&data, "conversion", 0.5);
        text(&data, "unit", "volts");
        let factors = Array1::from_shape_fn(60, |channel| channel as f32 + 1.0);
        group.new_dataset_builder().with_data(&factors).create("channel_conversion").unwrap();
    });
    let [acc, factors, rest @ ..] = contents.channels.as_slice() else { panic!("{:?}", contents.remarks) };
    assert_eq!((acc.location.as_str(), acc.unit.as_str()), ("/acquisition/acc/data", "V"));
    assert_eq!(acc.sample_rate_hz, Some(5000.0));
    assert_eq!(values(acc), codes.map(|code| f64::from(*code) / 16.0 + 0.5).to_vec());
    assert_eq!(factors.location, "/acquisition/array/channel_conversion");
    assert_eq!(rest.len(), 60, "{:?}", contents.remarks);
    for (channel, found) in rest.iter().enumerate() {
        assert_eq!(found.location, format!("/acquisition/array/data[{channel}]"));
        assert_eq!((found.unit.as_str(), found.sample_rate_hz), ("V", Some(5000.0)));
        let factor = 0.5 * (channel as f64 + 1.0);
        assert_eq!(values(found), [0, 100, 200].map(|first| (first + channel) as f64 * factor));
    }
}

#[test]
fn nwb_without_what_it_needs_gives_neither_unit_nor_rate() {
    let line = Array1::from_shape_fn(300, |sample| sample as i16);
    let contents = opened("nwb-odd", |file| {
        let group = series(file, "a", "ElectricalSeries", "seconds");
        let data = group.new_dataset_builder().with_data(&line).create("data").unwrap();
        number(&data, "conversion", 0.5);
        text(&data, "unit", "volts");
        group.new_dataset_builder().with_data(&[1.0, 2.0]).create("channel_conversion").unwrap();
        let group = series(file, "b", "TimeSeries", "samples");
        let data = group.new_dataset_builder().with_data(&line).create("data").unwrap();
        text(&data, "unit", "volts");
        // another program's group
        let data = file.create_group("c").unwrap().new_dataset_builder().with_data(&line).create("data").unwrap();
        number(&data, "conversion", 0.5);
        text(&data, "unit", "volts");
    });
    let found: Vec<_> = contents
        .channels
        .iter()
        .filter(|channel| channel.location.ends_with("/data"))
        .map(|channel| (channel.location.as_str(), channel.unit.as_str(), channel.scale_factor, channel.sample_rate_hz))
        .collect();
    let wanted = [("/a/data", "", 1.0, Some(5000.0)), ("/b/data", "", 1.0, None), ("/c/data", "", 1.0, None)];
    assert_eq!(found, wanted, "{:?}", contents.remarks);
    assert!(says(&contents, "channel_conversion does not have"), "{:?}", contents.remarks);
    assert!(says(&contents, "/b/data: no sample rate"), "{:?}", contents.remarks);
    assert!(says(&contents, "/b/data holds whole numbers in «V» without a scale"));
}

#[test]
fn times_of_nwb_are_the_rate_of_their_series() {
    let contents = opened("nwb-times", |file| {
        let group = file.create_group("acquisition/acc").unwrap();
        text(&group, "neurodata_type", "TimeSeries");
        let rows = Array2::from_shape_fn((400, 2), |(sample, channel)| (sample + channel) as f32);
        let data = group.new_dataset_builder().with_data(&rows).create("data").unwrap();
        number(&data, "conversion", 2.0);
        text(&data, "unit", "meters");
        let times = Array1::from_shape_fn(400, |sample| 10.0 + sample as f64 * 1e-3);
        let times = group.new_dataset_builder().with_data(&times).create("timestamps").unwrap();
        text(&times, "unit", "seconds");
    });
    let found: Vec<_> = contents
        .channels
        .iter()
        .map(|channel| (channel.location.as_str(), channel.samples, channel.sample_rate_hz, channel.unit.as_str()))
        .collect();
    let wanted = ["/acquisition/acc/data[0]", "/acquisition/acc/data[1]"].map(|name| (name, 400, Some(1000.0), "m"));
    assert_eq!(found, wanted, "{:?}", contents.remarks);
    assert_eq!(values(&contents.channels[1])[..3], [2.0, 4.0, 6.0]);
}
