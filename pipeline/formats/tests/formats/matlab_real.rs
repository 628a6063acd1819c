//! Real files. Every number was printed by scipy 1.17.1: `repr(float(loadmat(f)[k].sum()))` and so on.

// Pi, the root of 2 and so on are samples here, as printed.
#![allow(clippy::approx_constant)]

use crate::support::{channel, locations, real, remarked, samples};
use afmid_formats::readers::matlab::Mat;
use afmid_formats::{Contents, Format, FormatError};

fn open(name: &str) -> Option<Result<Contents, FormatError>> {
    let path = real(&format!("mat/{name}"))?;
    let bytes = std::fs::read(&path).unwrap();
    assert!(Mat::recognises(&bytes[..bytes.len().min(4096)], &path), "{name}");
    Some(Mat::open(&path))
}

/// Location, number of samples, type, and some samples with their index.
type Wanted<'a> = (&'a str, usize, &'a str, &'a [(usize, f64)], f64);

fn holds(name: &str, wanted: &[Wanted]) -> Option<Contents> {
    let contents = open(name)?.unwrap();
    let found: Vec<&str> = wanted.iter().map(|wanted| wanted.0).collect();
    assert_eq!(locations(&contents), found, "{name}: {:?}", contents.remarks);
    for (location, count, stored_as, single, sum) in wanted {
        let channel = channel(&contents, location);
        assert_eq!((channel.samples, channel.stored_as), (*count, *stored_as), "{name} {location}");
        let samples = samples(channel);
        for (index, value) in *single {
            assert_eq!(samples[*index], *value, "{name} {location}");
        }
        // The order of summation may differ: a few units in the last place.
        assert!((samples.iter().sum::<f64>() - sum).abs() <= 4.0 * f64::EPSILON * sum.abs(), "{name} {location}");
        assert_eq!(channel.sample_rate_hz, None);
    }
    assert_eq!(contents.started_at, "");
    Some(contents)
}

#[test]
fn level_4_of_both_byte_orders() {
    let single = [(1, 0.7853981633974483), (8, 6.283185307179586)];
    if let Some(big) = holds("testdouble_4.2c_SOL2.mat", &[("/testdouble", 9, "float64", &single, 28.27433388230814)]) {
        assert_eq!(big.format, "MATLAB 4 MAT-file, big-endian");
    }
    let params: Wanted = ("/fit_params", 2, "float64", &[(1, 0.007511302558266769)], 1276613640.6245465);
    let filt: Wanted = ("/xdot_filt", 2, "float64", &[(1, 1.2850403900699359e-11)], 1.366155837545166e-11);
    if let Some(little) = holds("testvec_4_GLNX86.mat", &[params, filt]) {
        assert_eq!(little.format, "MATLAB 4 MAT-file, little-endian");
    }
}

#[test]
fn compressed_variables() {
    let single = [(1, 0.7853981633974483), (8, 6.283185307179586)];
    // loadmat gives a = [[1,2,3,4,5],[2,0,0,0,0],[3,0,0,0,0]]; each column is a channel.
    let a = |location| -> Wanted { (location, 3, "uint8", &[(1, 0.0), (2, 0.0)], f64::NAN) };
    let mut wanted: Vec<Wanted> = vec![("/a[1]", 3, "uint8", &[(0, 1.0), (1, 2.0), (2, 3.0)], 6.0)];
    for (location, sum) in [("/a[2]", 2.0), ("/a[3]", 3.0), ("/a[4]", 4.0), ("/a[5]", 5.0)] {
        let (name, count, kind, single, _) = a(location);
        wanted.push((name, count, kind, single, sum));
    }
    wanted.push(("/theta", 9, "float64", &single, 28.27433388230814));
    if let Some(contents) = holds("testmulti_7.4_GLNX86.mat", &wanted) {
        assert!(remarked(&contents, "Platform: GLNX86"));
    }
}

#[test]
fn single_precision_of_both_byte_orders_beside_cells_of_texts() {
    for (name, order) in [("big_endian.mat", "big"), ("little_endian.mat", "little")] {
        let wanted: [Wanted; 2] = [
            ("/floats[1]", 2, "float32", &[(0, 2.0), (1, 3.0)], 5.0),
            ("/floats[2]", 2, "float32", &[(0, 3.0), (1, 4.0)], 7.0),
        ];
        let Some(contents) = holds(name, &wanted) else { return };
        assert_eq!(contents.format, format!("MATLAB 5 MAT-file, {order}-endian"));
        assert!(remarked(&contents, "/strings{1} is the text \"hello\""), "{:?}", contents.remarks);
        assert!(remarked(&contents, "/strings{2} is the text \"world\""));
    }
}

#[test]
fn three_dimensions_in_a_smaller_type() {
    // loadmat: v[:, j, k] = [1, 2] + 2 j + 6 k
    let names: Vec<(String, f64)> =
        (0..12).map(|n| (format!("/test3dmatrix[{},{}]", n % 3 + 1, n / 3 + 1), 1.0 + 2.0 * f64::from(n))).collect();
    let singles: Vec<[(usize, f64); 2]> = names.iter().map(|(_, first)| [(0, *first), (1, first + 1.0)]).collect();
    let wanted: Vec<Wanted> = names
        .iter()
        .zip(&singles)
        .map(|((name, first), singles)| (name.as_str(), 2, "uint8", &singles[..], 2.0 * first + 1.0))
        .collect();
    holds("test3dmatrix_6.1_SOL2.mat", &wanted);
}

#[test]
fn cells_and_structs_are_walked() {
    let wanted: [Wanted; 2] = [
        ("/testcell{3}", 2, "uint8", &[(0, 1.0), (1, 2.0)], 3.0),
        ("/testcell{4}", 3, "uint8", &[(0, 1.0), (2, 3.0)], 6.0),
    ];
    if let Some(contents) = holds("testcell_7.4_GLNX86.mat", &wanted) {
        assert!(remarked(&contents, "/testcell{1} is the text \"This cell contains this string and 3 arrays"));
        assert!(remarked(&contents, "/testcell{2} is the single number 1"));
    }
    let single = [(0, 1.4142135623730951), (1, 2.7182818284590455), (2, 3.141592653589793)];
    let wanted: [Wanted; 1] = [("/teststruct.doublefield", 3, "float64", &single, 7.274088044421934)];
    if let Some(contents) = holds("teststruct_7.4_GLNX86.mat", &wanted) {
        assert!(remarked(&contents, "/teststruct.stringfield is the text \"Rats live on no evil star.\""));
        assert!(remarked(&contents, "/teststruct.complexfield is complex"));
    }
}

#[test]
fn what_is_no_channel_is_remarked() {
    if let Some(contents) = holds("testcomplex_7.4_GLNX86.mat", &[]) {
        assert!(remarked(&contents, "/testcomplex is complex"));
    }
    if let Some(contents) = holds("testsparse_7.4_GLNX86.mat", &[]) {
        assert!(remarked(&contents, "/testsparse is a sparse matrix"));
    }
}

#[test]
fn damaged_files_and_hdf5_are_refused_with_a_byte() {
    let refused = |name: &str| open(name).map(|found| found.unwrap_err());
    if let Some(error) = refused("malformed1.mat") {
        // Line feeds were replaced, so the size is 0a0d98 instead of 0a98.
        assert_eq!(error.at_byte, Some(136), "{error:?}");
        assert!(error.problem.contains("658840 bytes") && error.help.unwrap().contains("text mode"));
    }
    if let Some(error) = refused("corrupted_zlib_data.mat") {
        // The third variable's element begins at byte 222 (8 bytes of tag) and ends with the file, 3451.
        assert!(error.at_byte.is_some_and(|at| (230..=3451).contains(&at)), "{error:?}");
        assert!(error.problem.contains("compressed data"), "{error:?}");
    }
    if let Some(error) = refused("testhdf5_7.4_GLNX86.mat") {
        assert!(error.problem.contains("7.3") && error.help.unwrap().contains("HDF5"));
    }
}
