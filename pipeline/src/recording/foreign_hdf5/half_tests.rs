//! Half precision of this machine's byte order, in every way that the library stores it.

use hdf5::types::{FloatSize, TypeDescriptor};
use ndarray::{Array1, Array2};

use super::super::{InputFiles, Reading, open_contents};
use crate::files::fixture::Folder;

/// Whole and binary fractions that ten bits of fraction hold.
fn value(sample: usize) -> f32 {
    (sample % 2000) as f32 / 8.0 - 100.0
}

#[test]
fn half_precision_is_exact_however_it_is_stored() {
    let folder = Folder::new("half");
    let path = folder.file("half.h5");
    let file = hdf5::File::create(&path).unwrap();
    let kind = TypeDescriptor::Float(FloatSize::U2);
    let rows = Array2::from_shape_fn((3, 900), |(row, sample)| value(300 * row + sample));
    let line = Array1::from_shape_fn(900, value);
    let make = || file.new_dataset_builder().empty_as(&kind);
    make().shape(900).create("line").unwrap().write(&line).unwrap();
    make().shape(900).chunk(128).shuffle().deflate(3).create("deflated").unwrap().write(&line).unwrap();
    make().shape(900).chunk(128).fletcher32().create("checked").unwrap().write(&line).unwrap();
    make().shape((3, 900)).create("rows").unwrap().write(&rows).unwrap();
    make().shape((3, 900)).chunk((2, 100)).deflate(3).create("chunks").unwrap().write(&rows).unwrap();
    file.close().unwrap();
    let (_, contents) = open_contents(&InputFiles::new(), &path, &Reading::of("auto", None)).unwrap();
    let names: Vec<&str> = contents.channels.iter().map(|channel| channel.location.as_str()).collect();
    let wanted = [
        "/checked",
        "/chunks[0]",
        "/chunks[1]",
        "/chunks[2]",
        "/deflated",
        "/line",
        "/rows[0]",
        "/rows[1]",
        "/rows[2]",
    ];
    assert_eq!(names, wanted, "{:?}", contents.remarks);
    for channel in &contents.channels {
        let row = channel.location.split(['[', ']']).nth(1).map_or(0, |row| row.parse().unwrap());
        let wanted: Vec<f64> = (5..895).map(|sample| f64::from(value(300 * row + sample))).collect();
        assert_eq!((channel.stored_as, channel.samples), ("float16", 900));
        assert_eq!(channel.source.read(5, 890).unwrap().widened(), wanted, "{}", channel.location);
    }
}
