//! Every file of the folder of real files loads with the values that its field's Python reader gives, or is refused
//! with a reason. A new file without an expectation fails.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{InputFiles, Reading, open_contents};

/// What a file must give.
enum Expected {
    /// Channels with their samples and the sum of their values.
    Channels(&'static [(&'static str, usize, f64)]),
    /// A refusal with these words.
    Refused(&'static str),
    /// It is read, holds no channel, and this is why.
    NoChannel(&'static str),
}
use Expected::{Channels, NoChannel, Refused};

/// Sums: npTDMS 1.13.0 (`np.sum(channel[:], dtype=float)`), igor2 0.5.15, lvm_read, pyuff, SciFiReaders 0.12.7 (codes
/// times the header's 0.000375 V), scipy 1.17.1 (`loadmat`), h5py (MATLAB 7.3): the tests of each format have more of
/// each file.
const FILES: &[(&str, Expected)] = &[
    (
        "ibw/IgorIBWReader_ForceCurve.ibw",
        Channels(&[
            ("/Raw", 1261, 0.0061165791548773996),
            ("/Defl", 1261, -0.0003419128072152944),
            ("/ZSnsr", 1261, 0.006116578664205008),
        ]),
    ),
    ("ibw/mac-version3Dependent.ibw", NoChannel("were not saved")),
    ("ibw/mac-version5.ibw", Channels(&[("/version5", 5, 15.0)])),
    ("ibw/mac-zeroPointWave.ibw", Channels(&[("/zeroWave", 0, 0.0)])),
    ("ibw/win-double.ibw", Channels(&[("/double", 5, 15.0)])),
    ("ibw/win-textWave.ibw", NoChannel("is a text wave")),
    ("ibw/win-version2.ibw", Channels(&[("/version2", 5, 15.0)])),
    ("ibw/win-version5.ibw", Channels(&[("/version5", 5, 15.0)])),
    ("lvm/multi_time_column.lvm", Channels(&[("Voltage", 3, -0.104302), ("Acceleration", 3, 1.50314)])),
    (
        "lvm/no_decimal_separator.lvm",
        Channels(&[("ax", 4, 0.012475000000000007), ("ay", 4, -0.093938), ("az", 4, 0.014253000000000002)]),
    ),
    (
        "lvm/short.lvm",
        Channels(&[("Excitation (Trigger)", 10, 6.917138), ("Response (Trigger)", 10, 12.138708000000001)]),
    ),
    (
        "lvm/with_comments.lvm",
        Channels(&[
            ("Pressão ABS. (MPa)", 9, 15.257150000000001),
            ("X_Value", 9, 29.362344999999998),
            ("Temperatura (°C)", 9, 48.866488000000004),
            ("Volume (ml)", 9, 718.5731000000001),
        ]),
    ),
    (
        "lvm/with_empty_fields.lvm",
        Channels(&[
            ("Dev0/Ai0", 7, -0.09976299999999999),
            ("Dev0/Ai2", 7, 50.767824999999995),
            ("Dev0/Ai0 1", 7, -0.09976299999999999),
        ]),
    ),
    ("mat/big_endian.mat", Channels(&[("/floats[1]", 2, 5.0), ("/floats[2]", 2, 7.0)])),
    ("mat/corrupted_zlib_data.mat", Refused("compressed data")),
    ("mat/little_endian.mat", Channels(&[("/floats[1]", 2, 5.0), ("/floats[2]", 2, 7.0)])),
    ("mat/malformed1.mat", Refused("658840 bytes")),
    (
        "mat/test3dmatrix_6.1_SOL2.mat",
        Channels(&[
            ("/test3dmatrix[1,1]", 2, 3.0),
            ("/test3dmatrix[2,1]", 2, 7.0),
            ("/test3dmatrix[3,1]", 2, 11.0),
            ("/test3dmatrix[1,2]", 2, 15.0),
            ("/test3dmatrix[2,2]", 2, 19.0),
            ("/test3dmatrix[3,2]", 2, 23.0),
            ("/test3dmatrix[1,3]", 2, 27.0),
            ("/test3dmatrix[2,3]", 2, 31.0),
            ("/test3dmatrix[3,3]", 2, 35.0),
            ("/test3dmatrix[1,4]", 2, 39.0),
            ("/test3dmatrix[2,4]", 2, 43.0),
            ("/test3dmatrix[3,4]", 2, 47.0),
        ]),
    ),
    ("mat/testcell_7.4_GLNX86.mat", Channels(&[("/testcell{3}", 2, 3.0), ("/testcell{4}", 3, 6.0)])),
    ("mat/testcomplex_7.4_GLNX86.mat", NoChannel("/testcomplex is complex")),
    ("mat/testdouble_4.2c_SOL2.mat", Channels(&[("/testdouble", 9, 28.27433388230814)])),
    // sum of k pi / 4, k = 0 to 8, as in the MATLAB 4 file of the same variable
    ("mat/testhdf5_7.4_GLNX86.mat", Channels(&[("/testdouble", 9, 28.27433388230814)])),
    (
        "mat/testmulti_7.4_GLNX86.mat",
        Channels(&[
            ("/a[1]", 3, 6.0),
            ("/a[2]", 3, 2.0),
            ("/a[3]", 3, 3.0),
            ("/a[4]", 3, 4.0),
            ("/a[5]", 3, 5.0),
            ("/theta", 9, 28.27433388230814),
        ]),
    ),
    ("mat/testsparse_7.4_GLNX86.mat", NoChannel("/testsparse is a sparse matrix")),
    ("mat/teststruct_7.4_GLNX86.mat", Channels(&[("/teststruct.doublefield", 3, 7.274088044421934)])),
    (
        "mat/testvec_4_GLNX86.mat",
        Channels(&[("/fit_params", 2, 1276613640.6245465), ("/xdot_filt", 2, 1.366155837545166e-11)]),
    ),
    (
        "spm/BrukerReader_ForceCurve_Sapphire_TAP525.001",
        Channels(&[
            ("/DeflectionError/extend", 512, -10620.0 * 0.000375),
            ("/DeflectionError/retract", 512, -16897.0 * 0.000375),
            ("/ZSensor/extend", 512, 812_282.0 * 0.000375),
            ("/ZSensor/retract", 512, 839_572.0 * 0.000375),
        ]),
    ),
    ("spm/bruker_data_header.000", Refused("header only")),
    (
        "tdms/Digital_Input.tdms",
        Channels(&[
            ("/'07/09/2012 06:58:23 PM - Digital Input - All Data'/'Dev1_port3_line7 - line 0'", 20_000, 10_000.0),
            (
                "/'07/09/2012 06:58:23 PM - Digital Input - Decimated Data_Level1'/'Dev1_port3_line7 - line 0'",
                400,
                200.0,
            ),
            ("/'07/09/2012 06:58:23 PM - Digital Input - Decimated Data_Level2'/'Dev1_port3_line7 - line 0'", 8, 4.0),
        ]),
    ),
    (
        "tdms/big_endian.tdms",
        Channels(&[
            ("/Measured Data/Amplitude sweep", 3500, 92.4168263064218),
            ("/Measured Data/Phase sweep", 3500, 24.607279472921544),
        ]),
    ),
    (
        "tdms/raw1.tdms",
        Channels(&[
            ("/Layer Data/First  Channel", 2000, 129.41648609881895),
            ("/Layer Data/Second Chan", 2000, 1819.5751823480941),
            ("/Layer Data/Third Chan", 2000, 3475.2009643848996),
            ("/Layer Data/Fourth Chan", 2000, 5149.5931882686855),
            ("/Layer Data/Fifth Chan", 2000, 6759.486373485519),
            ("/Layer Data/Sixth Chan", 2000, 8314.76699118015),
            ("/Layer Data/Seventh Cha", 2000, 9808.32605975524),
        ]),
    ),
    ("tdms/raw_timestamps.tdms", Channels(&[("/Untitled/Untitled", 128, 3.247402347028583e-15)])),
    ("uff/Sample_UFF58b_bin.uff", Channels(&[("Mic 01", 79_292, 5.715040058740556)])),
    ("uff/sample_dataset58_psd.uff", NoChannel("are complex")),
];

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.flat_map(|path| if path.is_dir() { files_below(&path) } else { vec![path] }).collect();
    files.sort();
    files
}

#[test]
fn every_real_file_loads_right_or_is_refused_with_a_reason() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("AFMID_DATA").map_or_else(beside, PathBuf::from).join("loaders");
    if !folder.is_dir() {
        println!("stand-in: 0 of {} real files tested, {} is missing", FILES.len(), folder.display());
        return;
    }
    let mut tested = 0;
    for path in files_below(&folder) {
        let name = path.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        if name == "PROVENANCE.txt" {
            continue;
        }
        let expected = FILES.iter().find(|(file, _)| *file == name);
        let (_, expected) = expected.unwrap_or_else(|| panic!("{name} is new: say what it must give"));
        check(&name, &path, expected);
        tested += 1;
    }
    assert_eq!(tested, FILES.len(), "files are missing");
}

fn check(name: &str, path: &Path, expected: &Expected) {
    let opened = open_contents(&InputFiles::new(), path, &Reading::of("auto", None));
    match (expected, opened) {
        (Refused(words), Err(error)) => {
            assert!(error.to_string().contains(words) && error.help.is_some(), "{name}: {error}");
            assert!(error.place.is_some(), "{name}");
        }
        (NoChannel(words), Ok((_, contents))) => {
            assert!(contents.channels.is_empty(), "{name}");
            assert!(contents.remarks.iter().any(|remark| remark.contains(words)), "{name}: {:?}", contents.remarks);
        }
        (Channels(wanted), Ok((_, contents))) => {
            let found: Vec<(&str, usize)> =
                contents.channels.iter().map(|channel| (channel.location.as_str(), channel.samples)).collect();
            let listed: Vec<(&str, usize)> =
                wanted.iter().map(|(location, samples, _)| (*location, *samples)).collect();
            assert_eq!(found, listed, "{name}: {:?}", contents.remarks);
            for (channel, (location, samples, sum)) in contents.channels.iter().zip(*wanted) {
                let mut values = Vec::new();
                let raw = channel.source.read(0, *samples).unwrap();
                raw.scale_into(channel.scale_factor, channel.add_offset, &mut values);
                let magnitudes: f64 = values.iter().map(|value| value.abs()).sum();
                // another order of summation, and a scale applied before or after it: n eps of the sum of magnitudes,
                // twice
                let tolerance = 2.0 * (*samples as f64) * f64::EPSILON * magnitudes;
                let found: f64 = values.iter().sum();
                assert!((found - sum).abs() <= tolerance, "{name} {location}: {found} instead of {sum}");
            }
        }
        (_, opened) => {
            panic!("{name}: {:?}", opened.map(|(format, contents)| (format, contents.channels.len(), contents.remarks)))
        }
    }
}

/// HDF5 files of `scopes` as h5py reads them: `f[path][:, n]` times the group's `encoder.scaling.multiplier` plus its
/// offset.
#[test]
fn hdf5_recordings_of_microscopes_and_fibres_have_values_not_codes_and_no_times_among_their_signals() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("AFMID_DATA").map_or_else(beside, PathBuf::from).join("scopes");
    if !folder.is_dir() {
        println!("stand-in: 0 of 2 real files tested, {} is missing", folder.display());
        return;
    }
    let open =
        |name: &str| open_contents(&InputFiles::new(), &folder.join(name), &Reading::of("auto", None)).unwrap().1;
    let jpk = open("jpk_sample_0.h5-jpk");
    let values = |location: &str| {
        let channel = jpk.channels.iter().find(|channel| channel.location == location).unwrap();
        let mut values = Vec::new();
        let raw = channel.source.read(0, channel.samples).unwrap();
        raw.scale_into(channel.scale_factor, channel.add_offset, &mut values);
        (channel.unit.clone(), channel.sample_rate_hz, values)
    };
    let (unit, rate, error) = values("/Measurement_000/Channel_000/Error[0]");
    let least = error.iter().copied().fold(f64::INFINITY, f64::min);
    // the least code is -6350353
    assert_eq!((unit.as_str(), rate, error.len(), least), ("V", None, 16_384, -6_350_353.0 * 5.227_498_044_396_503e-9));
    let (unit, _, phase) = values("/Measurement_000/Channel_002/Phase[0]");
    assert_eq!((unit.as_str(), phase.len()), ("deg", 16_384));
    assert!(phase.iter().all(|value| (-180.0..=180.0).contains(value)));
    let fibre = open("das_valencia_febus.h5");
    assert!(fibre.channels.iter().all(|channel| channel.is_axis && channel.sample_rate_hz.is_none()));
    assert_eq!(fibre.channels[0].location, "/fa1-20050027/Source1/time");
    assert!(fibre.remarks.iter().any(|remark| remark.contains("shape [10, 250, 100]")), "{:?}", fibre.remarks);
}
