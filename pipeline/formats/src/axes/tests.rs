//! Which channels are axes, and what they give.

use super::*;
use crate::pinned::stretch_of;
use crate::{FormatError, Raw, Source};
use std::sync::Arc;

#[derive(Debug)]
struct Values(Vec<f64>);

impl Source for Values {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        stretch_of(&self.0, start, count)
    }
}

fn channel(location: &str, values: Vec<f64>) -> FoundChannel {
    FoundChannel::new(location, values.len(), "float64", Arc::new(Values(values)))
}

fn times(count: u32, step: f64) -> Vec<f64> {
    (0..count).map(|row| f64::from(row) * step).collect()
}

fn noise(count: u32) -> Vec<f64> {
    (0..count).map(|row| f64::from(row * 7919 % 97)).collect()
}

/// Location, rate and whether it is an axis.
fn settled(channels: Vec<FoundChannel>) -> Vec<(String, Option<f64>, bool)> {
    let mut contents = Contents {
        format: String::new(),
        started_at: String::new(),
        channels,
        responses: Vec::new(),
        remarks: Vec::new(),
    };
    settle(&mut contents);
    contents.channels.into_iter().map(|c| (c.location, c.sample_rate_hz, c.is_axis)).collect()
}

fn is(location: &str, rate: Option<f64>) -> (String, Option<f64>, bool) {
    (location.to_owned(), rate, false)
}

#[test]
fn times_give_their_rate_to_arrays_of_their_length() {
    for name in ["/time", "/t", "/Time", "/time_s"] {
        let found = settled(vec![channel(name, times(50, 1e-3)), channel("/y", noise(50)), channel("/z", noise(49))]);
        assert_eq!(found, [is("/y", Some(1000.0)), is("/z", None)], "{name}");
    }
    let milliseconds = settled(vec![channel("/t_ms", times(50, 0.5)), channel("/y[2]", noise(50))]);
    assert_eq!(milliseconds, [is("/y[2]", Some(2000.0))]);
}

#[test]
fn axes_belong_to_their_struct_and_their_cell() {
    let structs = settled(vec![
        channel("/Out.Time", times(50, 0.1)),
        channel("/Out.y", noise(50)),
        channel("/Out.in.y", noise(50)),
        channel("/Other.y", noise(50)),
    ]);
    assert_eq!(structs, [is("/Out.y", Some(10.0)), is("/Out.in.y", Some(10.0)), is("/Other.y", None)]);
    let cells = settled(vec![
        channel("/t{1}", times(50, 0.1)),
        channel("/t{2}", times(50, 0.2)),
        channel("/y{1}", noise(50)),
        channel("/y{2}", noise(50)),
    ]);
    assert_eq!(cells, [is("/y{1}", Some(10.0)), is("/y{2}", Some(5.0))]);
}

#[test]
fn an_x_beside_a_y_is_an_axis_if_it_rises_evenly() {
    let even = settled(vec![channel("/xData{1}", times(50, 0.1)), channel("/yData{1}", noise(50))]);
    assert_eq!(even, [is("/yData{1}", Some(10.0))]);
    let input = settled(vec![channel("/x", noise(50)), channel("/y", noise(50))]);
    assert_eq!(input, [is("/x", None), is("/y", None)]);
    let alone = settled(vec![channel("/x", times(50, 0.1)), channel("/u", noise(50))]);
    assert_eq!(alone, [is("/x", None), is("/u", None)]);
}

#[test]
fn cells_of_times_are_axes_of_the_cells_beside_them() {
    let cells = |steps: [f64; 2]| {
        settled(vec![
            channel("/d{1}", times(50, steps[0])),
            channel("/d{2}", times(50, steps[1])),
            channel("/d{3}", noise(50)),
            channel("/d{4}", noise(50)),
        ])
    };
    assert_eq!(cells([0.1, 0.1]), [is("/d{3}", Some(10.0)), is("/d{4}", Some(10.0))]);
    assert_eq!(cells([0.1, 0.2]), [is("/d{3}", Some(10.0)), is("/d{4}", Some(5.0))]);
    let ramp: Vec<f64> = times(50, 0.1).iter().map(|value| value - 3.0).collect();
    let ramps = settled(vec![channel("/d{1}", ramp), channel("/d{2}", noise(50))]);
    assert_eq!(ramps, [is("/d{1}", None), is("/d{2}", None)]);
}

#[test]
fn times_in_single_precision_far_from_zero_are_refused_or_have_an_error() {
    for (offset, given) in [(0.0, true), (10.0, true), (100.0, true), (300.0, false), (1000.0, false)] {
        let single: Vec<f64> = (0..8000).map(|k| f64::from((offset + f64::from(k) * 1e-4) as f32)).collect();
        let mut time = channel("/time", single);
        (time.stored_as, time.unit) = ("float32", "s".to_owned());
        let mut contents = Contents {
            format: String::new(),
            started_at: String::new(),
            channels: vec![time, channel("/y", noise(8000))],
            responses: Vec::new(),
            remarks: Vec::new(),
        };
        settle(&mut contents);
        let found = contents.channels.iter().find(|channel| channel.location == "/y").unwrap();
        assert_eq!(found.sample_rate_hz.is_some(), given, "{offset}: {:?}", contents.remarks);
        let far = found.sample_rate_hz.map_or(0.0, |rate| (rate / 1e4 - 1.0).abs());
        assert!(far <= 4.0 * found.rate_relative_std + 1e-9, "{offset}: {far} {}", found.rate_relative_std);
    }
}

#[test]
fn rounded_times_are_even_and_a_lost_sample_is_a_gap() {
    let rounded: Vec<f64> = times(1000, 1.953125e-4).iter().map(|t| (t * 1e7).round() / 1e7).collect();
    let found = settled(vec![channel("/t", rounded.clone()), channel("/y", noise(1000))]);
    // of the rates that the rounding allows the one with the fewest digits
    assert_eq!(found, [is("/y", Some(5120.0))]);
    let mut lost = rounded;
    lost.iter_mut().skip(500).for_each(|time| *time += 1.953125e-4);
    let mut contents = Contents {
        format: String::new(),
        started_at: String::new(),
        channels: vec![channel("/t", lost), channel("/y", noise(1000))],
        responses: Vec::new(),
        remarks: Vec::new(),
    };
    settle(&mut contents);
    let found = &contents.channels[0];
    assert_eq!((found.sample_rate_hz, &found.gaps[..]), (Some(5120.0), &[500][..]));
    assert!(contents.remarks.iter().any(|remark| remark.contains("a gap")), "{:?}", contents.remarks);
}

#[test]
fn axes_without_a_rate_are_axes_all_the_same() {
    let axis = |location: &str| (location.to_owned(), None, true);
    let uneven = settled(vec![channel("/t", noise(50)), channel("/y", noise(50))]);
    assert_eq!(uneven, [axis("/t"), is("/y", None)]);
    let counter = settled(vec![channel("/t", times(50, 1.0)), channel("/y", noise(50))]);
    assert_eq!(counter, [axis("/t"), is("/y", None)]);
    let mut response = channel("/s.gain", noise(50));
    response.sample_rate_hz = Some(5.0);
    let frequency = settled(vec![channel("/s.frequency", times(50, 0.1)), response]);
    assert_eq!(frequency, [axis("/s.frequency"), is("/s.gain", None)]);
    let both =
        vec![channel("/df/index", times(50, 1.0)), channel("/df/time", times(50, 0.1)), channel("/df/y", noise(50))];
    assert_eq!(settled(both), [axis("/df/index"), is("/df/y", Some(10.0))]);
    let hertz = |location: &str, unit: &str, values: Vec<f64>| {
        let mut channel = channel(location, values);
        channel.unit = unit.to_owned();
        channel
    };
    for (name, unit) in [("/f", ""), ("/Hz", ""), ("/freq_kHz", ""), ("/x", "kHz"), ("/band", "Hz"), ("/f", "Hz")] {
        let found = settled(vec![hertz(name, unit, times(50, 0.5)), channel("/psd", noise(50))]);
        assert_eq!(found, [axis(name), is("/psd", None)], "{name} {unit}");
        let over_time = vec![hertz(name, unit, noise(50)), channel("/time", times(50, 0.1))];
        let wanted = if name == "/freq_kHz" { None } else { Some(is(name, Some(10.0))) };
        assert!(wanted.is_none_or(|wanted| settled(over_time) == [wanted]), "{name} {unit}");
    }
    let band: Vec<f64> = times(50, 0.25).iter().map(|f| f + 65_000.0).collect();
    assert_eq!(settled(vec![channel("/x", band), channel("/y", noise(50))]), [axis("/x"), is("/y", None)]);
    let temperature = settled(vec![channel("/T", times(50, 0.1)), channel("/y", noise(50))]);
    assert_eq!(temperature, [is("/T", None), is("/y", None)]);
}

#[test]
fn a_rate_that_disagrees_with_the_times_is_unknown() {
    let mut stated = channel("/y", noise(50));
    stated.sample_rate_hz = Some(999.0);
    let found = settled(vec![channel("/t", times(50, 1e-3)), stated.clone()]);
    assert_eq!(found, [("/t".to_owned(), None, true), is("/y", None)]);
    stated.sample_rate_hz = Some(1000.001);
    let found = settled(vec![channel("/t", times(50, 1e-3)), stated]);
    assert_eq!(found, [is("/y", Some(1000.001))]);
}
