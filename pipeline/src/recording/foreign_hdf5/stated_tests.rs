//! Time series of NWB and waveforms of Infiniium oscilloscopes.

use hdf5::types::VarLenUnicode;
use hdf5::{Group, Location};
use ndarray::{Array1, Array2};

use super::super::{InputFiles, Reading, open_contents};
use super::infiniium;
use super::stated::{Here, Stated};
use crate::files::fixture::Folder;
use crate::hdf5_files::read::open_file;
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

/// A group with `starting_time`, and with a type unless that is empty.
fn series(file: &hdf5::File, path: &str, kind: &str, clock_unit: &str) -> Group {
    let group = file.create_group(path).unwrap();
    if !kind.is_empty() {
        text(&group, "neurodata_type", kind);
    }
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
        let group = series(file, "acquisition/acc", "", "seconds");
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

/// A waveform of 300 samples with these units.
fn waveform(file: &hdf5::File, name: &str, units: (&str, &str), points: f64) -> Group {
    let group = file.create_group(&format!("Waveforms/{name}")).unwrap();
    for (name, value) in [("XInc", 2e-4), ("XOrg", -0.01), ("YInc", 0.25), ("YOrg", 1.5), ("NumPoints", points)] {
        number(&group, name, value);
    }
    text(&group, "XUnits", units.0);
    text(&group, "YUnits", units.1);
    group
}

#[test]
fn infiniium_scales_codes_and_leaves_values_as_they_are() {
    let codes = Array1::from_shape_fn(300, |sample| sample as i16 - 7);
    let volts = Array1::from_shape_fn(300, |sample| sample as f32 / 8.0);
    let contents = opened("infiniium", |file| {
        let put = |group: &Group, name: &str| group.new_dataset_builder().with_data(&codes).create(name).unwrap();
        put(&waveform(file, "Channel 1", ("Second", "Volt"), 300.0), "Channel 1Data");
        let memory = waveform(file, "Memory 1", ("Second", "Amp"), 300.0);
        memory.new_dataset_builder().with_data(&volts).create("Memory 1Data").unwrap();
        let segments = waveform(file, "Channel 2", ("Second", "Volt"), 300.0);
        put(&segments, "Channel 2 Seg1Data");
        put(&segments, "Channel 2 Seg2Data");
        put(&waveform(file, "Meas Spectrum", ("Hertz", "dB"), 300.0), "Meas SpectrumData");
        put(&waveform(file, "Function 1", ("Second", "Unknown"), 150.0), "Function 1Data");
        let other = waveform(file, "Channel 3", ("Second", "Volt"), 300.0);
        number(&other, "YReference", 128.0);
        put(&other, "Channel 3Data");
    });
    let found: Vec<_> = contents
        .channels
        .iter()
        .map(|channel| {
            let name = channel.location.rsplit('/').next().unwrap();
            (name, channel.unit.as_str(), channel.scale_factor, channel.add_offset, channel.sample_rate_hz)
        })
        .collect();
    let wanted = [
        ("Channel 1Data", "V", 0.25, 1.5, Some(5000.0)),
        ("Channel 2 Seg1Data", "V", 0.25, 1.5, Some(5000.0)),
        ("Channel 2 Seg2Data", "V", 0.25, 1.5, Some(5000.0)),
        ("Channel 3Data", "", 1.0, 0.0, Some(5000.0)),
        ("Function 1Data", "", 0.25, 1.5, None),
        ("Meas SpectrumData", "dB", 0.25, 1.5, None),
        ("Memory 1Data", "A", 1.0, 0.0, Some(5000.0)),
    ];
    assert_eq!(found, wanted, "{:?}", contents.remarks);
    assert_eq!(values(&contents.channels[0])[..2], [-0.25, 0.0]);
    for words in ["NumPoints is 150", "XUnits is «Hertz»", "YReference is 128"] {
        assert!(says(&contents, words), "{words}: {:?}", contents.remarks);
    }
}

#[test]
fn a_segment_has_a_start_of_its_own() {
    let folder = Folder::new("segments");
    let path = folder.file("made.h5");
    {
        let file = hdf5::File::create(&path).unwrap();
        let group = waveform(&file, "Channel 2", ("Second", "Volt"), 3.0);
        let first = group.new_dataset_builder().with_data(&[1_i16, 2, 3]).create("Channel 2 Seg1Data").unwrap();
        number(&first, "SegmentedXOrg", -0.5);
        group.new_dataset_builder().with_data(&[1_i16, 2, 3]).create("Channel 2 Seg2Data").unwrap();
    }
    let hashed = InputFiles::new().inspect_hdf5(&path).unwrap();
    let file = open_file(&path, &hashed.vetted).unwrap();
    let start = |name: &str| -> Stated {
        let group = file.group("Waveforms/Channel 2").unwrap();
        let dataset = group.dataset(name).unwrap();
        let location = format!("/Waveforms/Channel 2/{name}");
        let place = "/Waveforms/Channel 2";
        infiniium::of(Here {
            group: &group,
            path: place,
            dataset: &dataset,
            name,
            location: &location,
            allowance: file.allowance(),
        })
        .unwrap()
    };
    let starts = ["Channel 2 Seg1Data", "Channel 2 Seg2Data"].map(|name| start(name).start_s);
    assert_eq!(starts, [Some(-0.5), Some(-0.01)]);
}

#[test]
fn rates_and_starts_lie_in_attributes_of_a_dataset_or_its_group_and_in_numbers_beside_it() {
    let line = Array1::from_shape_fn(50, |sample| sample as f64);
    let contents = opened("starts", |file| {
        for (path, late) in [("a", 0.0), ("b", 3.0)] {
            let group = file.create_group(path).unwrap();
            let data = group.new_dataset_builder().with_data(&line).create("y").unwrap();
            text(&data, "fs", "10 kHz");
            number(&data, "start", late);
            text(&data, "start_unit", "ms");
        }
        for (path, late) in [("c", 0.0), ("d", 0.003)] {
            let group = file.create_group(path).unwrap();
            number(&group, "dt", 1e-4);
            number(&group, "t_start", late);
            group.new_dataset_builder().with_data(&line).create("y").unwrap();
        }
        for (path, late) in [("e", 0.0), ("f", 0.003)] {
            let group = file.create_group(path).unwrap();
            for (name, value) in [("fs", 1e4), ("t0", late)] {
                group.new_dataset::<f64>().create(name).unwrap().write_scalar(&value).unwrap();
            }
            group.new_dataset_builder().with_data(&line).create("y").unwrap();
        }
    });
    let clocks: Vec<_> = contents.channels.iter().map(|channel| (channel.sample_rate_hz, channel.start_s)).collect();
    let several = opened("several-rates", |file| {
        for (path, rates) in [("a", [1e4, 1e4]), ("b", [1e4, 2e4])] {
            let group = file.create_group(path).unwrap();
            group.new_dataset_builder().with_data(&rates).create("fs").unwrap();
            group.new_dataset_builder().with_data(&line).create("y").unwrap();
        }
        let data = file.new_dataset_builder().with_data(&line).create("z").unwrap();
        data.new_attr_builder().with_data(&[5e3, 5e3]).create("fs").unwrap();
    });
    let rate = |name: &str| several.channels.iter().find(|channel| channel.location == name).unwrap().sample_rate_hz;
    assert_eq!((rate("/a/y"), rate("/b/y"), rate("/z")), (Some(1e4), None, Some(5e3)), "{:?}", several.remarks);
    let pair = [(Some(1e4), Some(0.0)), (Some(1e4), Some(0.003))];
    assert_eq!(clocks, [pair, pair, pair].concat(), "{:?}", contents.remarks);
}
