//! Nanoscope force curves: built, real ones against the header's numbers, and damaged ones.

use std::path::Path;

use crate::support::*;
use afmid_formats::readers::nanoscope::Nanoscope;
use afmid_formats::{Format, Raw};

/// Data begin here in built files.
const DATA_AT: usize = 2048;

/// A file with one force image list of the given lines and data.
fn file(force: &str, list: &str, data: &[u8]) -> Vec<u8> {
    let mut text =
        String::from("\\*Force file list\r\n\\Version: 0x08150308\r\n\\Date: 12:04:58 AM Thu May 17 2018\r\n");
    text += "\\*Scanner list\r\n\\@Sens. Zsens: V 35.88 nm/V\r\n";
    text += "\\*Ciao scan list\r\n\\@Sens. DeflSens: V 72.76923 nm/V\r\n\\Scan Rate: 9\r\n";
    text += &format!("\\*Ciao force list\r\n{force}");
    text += &format!("\\*Ciao force image list\r\n\\Data offset: {DATA_AT}\r\n\\Data length: {}\r\n{list}", data.len());
    text += "\\*File list end\r\n\x1a";
    let mut bytes = text.into_bytes();
    assert!(bytes.len() <= DATA_AT);
    bytes.resize(DATA_AT, 0);
    bytes.extend(data);
    bytes
}

const FORCE: &str = "\\Scan rate: 2\r\n\\Forward vel.: 30\r\n\\Reverse vel.: 10\r\n";
const LIST: &str = "\\Bytes/pixel: 2\r\n\\Samps/line: 3 2\r\n\\Spring Constant: 0.5\r\n\
    \\@4:Image Data: S [DeflectionError] \"Deflection Error\"\r\n\
    \\@4:Z scale: V [Sens. DeflSens] (0.0003750000 V/LSB) 2.5 V\r\n";

fn words(values: &[i16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Contents with the folder that their file is in, for samples are read later.
struct Kept(afmid_formats::Contents, #[allow(dead_code, reason = "removed when dropped")] tempfile::TempDir);

impl std::ops::Deref for Kept {
    type Target = afmid_formats::Contents;
    fn deref(&self) -> &afmid_formats::Contents {
        &self.0
    }
}

fn open(bytes: &[u8]) -> Kept {
    let (folder, contents) = open_bytes::<Nanoscope>("curve.000", bytes);
    Kept(contents.unwrap(), folder)
}

fn refusal(bytes: &[u8]) -> afmid_formats::FormatError {
    open_bytes::<Nanoscope>("curve.000", bytes).1.expect_err("must be refused")
}

#[test]
fn extend_is_turned_round_and_scaled_by_the_hard_scale() {
    let bytes = file(FORCE, LIST, &words(&[1, 2, 3, 4, -5]));
    assert!(Nanoscope::recognises(&bytes, Path::new("x")));
    let contents = open(&bytes);
    let (extend, retract) =
        (channel(&contents, "/DeflectionError/extend"), channel(&contents, "/DeflectionError/retract"));
    assert_eq!((codes(extend), codes(retract)), (vec![3.0, 2.0, 1.0], vec![4.0, -5.0]));
    assert_eq!(extend.source.read(0, 2).unwrap(), Raw::Int16(vec![3, 2]));
    assert_eq!(extend.source.read(2, 1).unwrap(), Raw::Int16(vec![1]));
    assert_eq!((extend.scale_factor, extend.unit.as_str(), extend.stored_as), (0.000375, "V", "int16"));
    assert_eq!(extend.long_name, "Deflection Error, extend");
    // 0.5 s a cycle; forth three times as fast as back: 0.125 s and 0.375 s
    near(extend.sample_rate_hz.unwrap(), 3.0 / 0.125, 1e-12); // rounding
    near(retract.sample_rate_hz.unwrap(), 2.0 / 0.375, 1e-12);
    assert_eq!(contents.started_at, "2018-05-17T00:04:58");
    assert_eq!(contents.format, "Bruker Nanoscope 8.15 (0x08150308), force curve");
    assert!(
        remarked(&contents, "Sens. DeflSens is 72.76923 nm/V") && remarked(&contents, "Spring Constant is 0.5 N/m")
    );
}

#[test]
fn four_byte_samples_and_a_hold_are_read() {
    let data: Vec<u8> = [1_i32, 2, 3, 4, -70_000, 6, 7].iter().flat_map(|v| v.to_le_bytes()).collect();
    for stated in ["4", "2"] {
        let list = LIST.replace("pixel: 2", &format!("pixel: {stated}"));
        let contents = open(&file(&format!("{FORCE}\\Hold Samples: 2\r\n\\Hold Time: 0.01\r\n"), &list, &data));
        let locations: Vec<_> = contents.channels.iter().map(|c| c.location.as_str()).collect();
        assert_eq!(locations, ["/DeflectionError/extend", "/DeflectionError/hold", "/DeflectionError/retract"]);
        assert_eq!(codes(&contents.channels[1]), [6.0, 7.0]);
        assert_eq!(contents.channels[1].sample_rate_hz, Some(200.0));
        assert_eq!(codes(&contents.channels[2]), [4.0, -70_000.0]);
        assert_eq!(contents.channels[2].stored_as, "int32");
    }
}

#[test]
fn what_the_header_lacks_is_remarked() {
    let bare = open(&file("", "\\Samps/line: 2\r\n\\@4:Image Data: S [] \"\"\r\n", &words(&[1, 2, 3, 4])));
    assert_eq!(codes(channel(&bare, "/data/extend")), [2.0, 1.0]);
    assert_eq!(
        (bare.channels[0].sample_rate_hz, bare.channels[0].scale_factor, bare.channels[0].unit.as_str()),
        (None, 1.0, "")
    );
    assert!(remarked(&bare, "no scan rate") && remarked(&bare, "values are codes"));
    let single = open(&file(FORCE, "\\Samps/line: 4\r\n", &words(&[1, 2, 3, 4])));
    assert_eq!(single.channels.len(), 1);
    let from_force_list = open(&file(&format!("{FORCE}\\Samps/line: 1 1\r\n"), "", &words(&[1, 2])));
    assert_eq!(codes(channel(&from_force_list, "/data/retract")), [2.0]);
    let lost = open(&file(FORCE, &LIST.replace("DeflSens", "Lost"), &words(&[1, 2, 3, 4, 5])));
    assert!(remarked(&lost, "soft scale Sens. Lost is not in the header"));
    let undated = open(
        &String::from_utf8(file(FORCE, LIST, &words(&[1, 2, 3, 4, 5])))
            .unwrap()
            .replace("12:04:58 AM", "12-04:58 AM")
            .into_bytes(),
    );
    assert!(undated.started_at.is_empty() && remarked(&undated, "the date `12-04:58"));
}

#[test]
fn what_is_no_force_curve_is_refused_with_a_reason() {
    assert!(
        refusal(&file(FORCE, LIST, &words(&[0; 50]))).problem.contains("found 10 curves in one list (a force volume)")
    );
    assert!(
        refusal(&file(FORCE, LIST, &words(&[0; 7])))
            .problem
            .contains("14 bytes of samples, which no curve of `Samps/line: 3 2` has")
    );
    assert!(
        refusal(&file(FORCE, &LIST.replace("pixel: 2", "pixel: 3"), &words(&[0; 5])))
            .problem
            .contains("3 bytes per pixel")
    );
    let sound = file(FORCE, LIST, &words(&[1, 2, 3, 4, 5]));
    assert!(refusal(&sound[..sound.len() - 1]).problem.contains("end of the file"));
    assert!(refusal(&sound[..DATA_AT]).problem.contains("header only"));
    assert!(refusal(&sound[..400]).problem.contains("no `\\*File list end`"));
    assert!(refusal(b"?*File list").problem.contains("found `?*File list`"));
    assert!(refusal(b"").problem.contains("found ``"));
    let image = "\\*File list\n\\*Ciao image list\n\\Data offset: 4\n\\Data length: 2\n\\Samps/line: 512\n\
        \\Scan Rate: 0.98\n\\*File list end\n";
    let image = refusal(image.as_bytes());
    assert!(image.problem.contains("1 images of 512 samples a line at 0.98 lines per second") && image.help.is_some());
    assert!(
        refusal(b"\\*File list\n\\*Nothing\n\\*File list end\n").problem.contains("wanted a Ciao force image list")
    );
    let text = String::from_utf8(sound).unwrap();
    assert!(refusal(text.replace("\\Data offset", "\\Data ofset").as_bytes()).problem.contains("no `Data offset`"));
    assert!(
        refusal(text.replace("offset: 2048", "offset: 18446744073709551615").as_bytes())
            .problem
            .contains("header only")
    );
}

#[test]
fn versions_that_are_not_known_are_not_read_and_samples_lie_behind_the_header() {
    let sound = String::from_utf8_lossy(&file(FORCE, LIST, &words(&[1, 2, 3, 4, 5]))).into_owned();
    for version in ["0x03000000", "0x42000000"] {
        let error = refusal(sound.replace("0x08150308", version).as_bytes());
        assert!(error.problem.starts_with("not read: this file is of Nanoscope version"), "{error:?}");
        assert!(!error.help.unwrap().contains("damaged"));
    }
    assert!(open(sound.replace("0x08150308", "0x10000000").as_bytes()).channels.len() == 2);
    let error = refusal(sound.replace("Data offset: 2048", "Data offset: 0100").as_bytes());
    assert!(error.problem.contains("found samples from byte 100, wanted them behind the header"), "{error:?}");
}

#[test]
fn a_header_without_data_is_refused() {
    let Some(path) = real("spm/bruker_data_header.000") else { return };
    assert!(Nanoscope::recognises(&std::fs::read(&path).unwrap()[..4096], &path));
    let error = Nanoscope::open(&path).unwrap_err();
    // the file has 34693 bytes, its header says `\Data offset: 40960`
    assert!(
        error.problem.contains("header only")
            && error.problem.contains("byte 40960")
            && error.problem.contains("byte 34693"),
        "{error:?}"
    );
}

/// Location, sum and samples 0, 1, 255, 511 of the codes. By `struct.unpack("<1024h", ...)` at the header's data
/// offsets 40960 and 43008, the first 512 turned round; SciFiReaders 0.12.7 (`BrukerAFMReader(path).read()`) gives the
/// same sums and, in stored order, samples.
const REAL: [(&str, f64, [f64; 4]); 4] = [
    ("/DeflectionError/extend", -10620.0, [-27.0, -26.0, -30.0, 537.0]),
    ("/DeflectionError/retract", -16897.0, [478.0, 423.0, -29.0, -26.0]),
    ("/ZSensor/extend", 812_282.0, [766.0, 768.0, 1584.0, 2411.0]),
    ("/ZSensor/retract", 839_572.0, [2411.0, 2408.0, 1645.0, 851.0]),
];

#[test]
fn a_real_force_curve_is_as_its_header_says() {
    let Some(path) = real("spm/BrukerReader_ForceCurve_Sapphire_TAP525.001") else { return };
    let contents = Nanoscope::open(&path).unwrap();
    assert_eq!(contents.format, "Bruker Nanoscope 8.15 (0x08150308), force curve");
    assert_eq!(contents.started_at, "2018-05-17T15:04:58", "header: 03:04:58 PM Thu May 17 2018");
    for (location, sum, samples) in REAL {
        let c = channel(&contents, location);
        let codes = codes(c);
        assert_eq!(codes.iter().sum::<f64>(), sum, "{location}");
        assert_eq!([0, 1, 255, 511].map(|i| codes[i]), samples, "{location}");
        assert_eq!((c.samples, c.unit.as_str(), c.scale_factor, c.stored_as), (512, "V", 0.000375, "int16"));
        // (512 + 512) samples * 1.02796 ramps per second; the header's `Effective BW: 1052.63` is the same rate to 6
        // digits
        near(c.sample_rate_hz.unwrap(), 1052.63104, 1e-12); // rounding
        near(c.sample_rate_hz.unwrap(), 1052.63, 5e-6);
    }
    assert_eq!(contents.channels.len(), 4);
    assert!(
        remarked(
            &contents,
            "DeflectionError: Sens. DeflSens is 72.76923 nm/V (Deflection Sensitivity Correction: 1.08)"
        ),
        "{:?}",
        contents.remarks
    );
    assert!(
        remarked(&contents, "Spring Constant is 90 N/m")
            && remarked(&contents, "ZSensor: Sens. ZsensSens is 960.1708 nm/V")
    );
    // the tip turns round where extend ends and retract begins: the sensor moves no further than between any samples
    let (extend, retract) =
        (codes(channel(&contents, "/ZSensor/extend")), codes(channel(&contents, "/ZSensor/retract")));
    assert!((extend[511] - retract[0]).abs() <= 4.0, "steps are about 3 codes");
}

#[test]
fn damaged_curves_never_panic() {
    let bytes = file(&format!("{FORCE}\\Hold Samples: 0\r\n"), LIST, &words(&[1, 2, 3, 4, 5]));
    survive::<Nanoscope>("curve.000", &bytes, 300, 2000, bytes.len());
    for name in ["BrukerReader_ForceCurve_Sapphire_TAP525.001", "bruker_data_header.000"] {
        let Some(path) = real(&format!("spm/{name}")) else { return };
        let bytes = std::fs::read(path).unwrap();
        survive::<Nanoscope>("curve.000", &bytes, 300, 2000, bytes.len());
    }
}
