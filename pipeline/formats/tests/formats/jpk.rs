//! JPK force curves and maps, built byte by byte. Values are compared with afmformats' reading of the same bytes; real
//! files are compared in scopes_real.rs.

use std::io::Write;
use std::path::Path;

use crate::support::*;
use afmid_formats::readers::jpk::JpkForce;
use afmid_formats::{Format, Raw};
use flate2::Crc;
use flate2::write::DeflateEncoder;

/// A zip archive, written entry by entry.
#[derive(Default)]
struct Zip {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    entries: u16,
}

impl Zip {
    fn add(mut self, name: &str, data: &[u8], deflate: bool) -> Self {
        let packed = if deflate {
            let mut encoder = DeflateEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(data).unwrap();
            encoder.finish().unwrap()
        } else {
            data.to_vec()
        };
        let mut crc = Crc::new();
        crc.update(data);
        let mut common = vec![20, 0, 0, 0, if deflate { 8 } else { 0 }, 0, 0, 0, 0x21, 0x28];
        for number in [crc.sum(), packed.len() as u32, data.len() as u32] {
            common.extend(number.to_le_bytes());
        }
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        let at = self.bytes.len() as u32;
        self.bytes.extend([b"PK\x03\x04".as_slice(), &common, name.as_bytes(), &packed].concat());
        self.directory
            .extend([b"PK\x01\x02\x14\x00".as_slice(), &common, &[0; 10], &at.to_le_bytes(), name.as_bytes()].concat());
        self.entries += 1;
        self
    }

    fn finish(mut self) -> Vec<u8> {
        let at = self.bytes.len() as u32;
        self.bytes.extend(&self.directory);
        self.bytes.extend(b"PK\x05\x06\0\0\0\0");
        self.bytes.extend([self.entries.to_le_bytes(), self.entries.to_le_bytes()].concat());
        self.bytes.extend([(self.directory.len() as u32).to_le_bytes(), at.to_le_bytes()].concat());
        self.bytes.extend([0, 0]);
        self.bytes
    }
}

/// The encoder and conversions of a deflection, below `prefix`; numbers as in the example that afmformats quotes.
fn deflection(prefix: &str, encoder: &str) -> String {
    let unit = |key: &str, unit: &str| format!("{prefix}{key}.unit.type=metric-unit\n{prefix}{key}.unit.unit={unit}\n");
    let scaling = |key: &str, multiplier: &str, offset: &str, u: &str| {
        format!(
            "{prefix}{key}.type=linear\n{prefix}{key}.style=offsetmultiplier\n{prefix}{key}.offset={offset}\n\
             {prefix}{key}.multiplier={multiplier}\n{}",
            unit(key, u)
        )
    };
    let slot = |name: &str, base: &str| {
        let key = format!("{prefix}conversion-set.conversion.{name}");
        format!(
            "{key}.name={name}\n{key}.defined=true\n{key}.type=simple\n{key}.base-calibration-slot={base}\n\
             {key}.calibration-slot={name}\n"
        )
    };
    let set = format!("{prefix}conversion-set.conversion");
    [
        scaling(&format!("{encoder}.scaling"), "3.0921021713588157E-4", "-0.00728873489143207", "V"),
        format!(
            "{set}s.list=distance force\n{set}s.default=force\n{set}s.base=volts\n{set}.volts.name=Volts\n\
            {set}.volts.defined=false\n"
        ),
        slot("distance", "volts"),
        scaling("conversion-set.conversion.distance.scaling", "7.000143623002982E-8", "1E-9", "m"),
        slot("force", "distance"),
        scaling("conversion-set.conversion.force.scaling", "0.043493666407368466", "0.0", "N"),
    ]
    .concat()
}

/// The encoder and conversion of a height.
fn height(prefix: &str, encoder: &str) -> String {
    deflection(prefix, encoder)
        .replace("distance", "nominal")
        .replace("force", "calibrated")
        .replace(".unit.unit=N", ".unit.unit=m")
}

fn segment(style: &str, points: usize, duration: &str) -> String {
    format!(
        "#comment\nforce-segment-header.num-points={points}\nforce-segment-header.duration={duration}\n\
         force-segment-header.settings.style={style}\n\
         force-segment-header.time-stamp=2016-02-05 13\\:27\\:32 +0100\nforce-segment-header.approach-id=a\n\
         force-segment-header.settings.segment-settings.duration={duration}\n\
         force-segment-header.settings.segment-settings.z-start=1.0\n\
         force-segment-header.settings.segment-settings.z-end=2.0\nchannels.list=vDeflection height\n"
    )
}

const SHORTS: [i16; 5] = [1, -2, 30_000, -30_000, 7];
const INTEGERS: [i32; 5] = [1, -2, 2_000_000, -2_000_000, 7];

fn shorts() -> Vec<u8> {
    SHORTS.iter().flat_map(|v| v.to_be_bytes()).collect()
}

fn integers() -> Vec<u8> {
    INTEGERS.iter().flat_map(|v| v.to_be_bytes()).collect()
}

const GENERAL: &str = "file-format-version=0.13\nforce-scan-series.header.position-index=0\n\
    force-scan-series.description.instrument=none\n";

/// A file whose segments hold all their properties.
fn version_1(deflate: bool) -> Vec<u8> {
    let mut zip = Zip::default().add("header.properties", GENERAL.as_bytes(), deflate).add("segments/", b"", false);
    for (number, style) in [(0, "extend"), (1, "retract")] {
        let channel = |name: &str, kind: &str, encoder: &str| {
            format!(
                "channel.{name}.data.file.name=channels/{name}.dat\nchannel.{name}.data.type={kind}\n\
                 channel.{name}.data.encoder.type={encoder}\n"
            )
        };
        let header = segment(style, 5, "0.25")
            + &channel("vDeflection", "short", "signedshort")
            + &deflection("channel.vDeflection.", "data.encoder")
            + &channel("height", "integer-data", "signedinteger")
            + &height("channel.height.", "data.encoder");
        zip = zip
            .add(&format!("segments/{number}/"), b"", false)
            .add(&format!("segments/{number}/segment-header.properties"), header.as_bytes(), deflate)
            .add(&format!("segments/{number}/channels/vDeflection.dat"), &shorts(), deflate)
            .add(&format!("segments/{number}/channels/height.dat"), &integers(), deflate);
    }
    zip.finish()
}

/// A file whose segments share what their channels have in common.
fn version_2() -> Vec<u8> {
    curves(&[("", 2)])
}

/// Curves of that layout: the folder and the number of segments of each.
fn curves(folders: &[(&str, u32)]) -> Vec<u8> {
    let shared = String::from(
        "lcd-info.0.channel.name=vDeflection\nlcd-info.0.type=short-data\nlcd-info.0.encoder.type=signedshort\n",
    ) + &deflection("lcd-info.0.", "encoder")
        + "lcd-info.1.type=integer-data\nlcd-info.1.encoder.type=signedinteger\n"
        + &height("lcd-info.1.", "encoder")
        + "force-segment-header-info.0.settings.style=extend\n";
    let header = segment("x", 5, "0.25")
        .replace("force-segment-header.settings.style=x\n", "force-segment-header.force-segment-header-info.*=0\n")
        + "channel.vDeflection.lcd-info.*=0\nchannel.vDeflection.data.file.name=channels/vDeflection.dat\n"
        + "channel.height.lcd-info.*=1\nchannel.height.data.file.name=channels/height.dat\n";
    let mut zip = Zip::default().add("header.properties", GENERAL.as_bytes(), true).add(
        "shared-data/header.properties",
        shared.as_bytes(),
        true,
    );
    for (curve, segments) in folders {
        zip = zip.add(&format!("{curve}segments/"), b"", false);
        for number in 0..*segments {
            let folder = format!("{curve}segments/{number}");
            zip = zip
                .add(&format!("{folder}/"), b"", false)
                .add(&format!("{folder}/segment-header.properties"), header.as_bytes(), true)
                .add(&format!("{folder}/channels/vDeflection.dat"), &shorts(), true)
                .add(&format!("{folder}/channels/height.dat"), &integers(), true);
        }
    }
    zip.finish()
}

/// A file of one segment with one channel `x` of these properties and data.
fn one(properties: &str, data: &[u8]) -> Vec<u8> {
    let header =
        format!("force-segment-header.num-points=2\nforce-segment-header.duration=0.5\nchannels.list=x\n{properties}");
    Zip::default()
        .add("header.properties", b"", true)
        .add("segments/0/segment-header.properties", header.as_bytes(), true)
        .add("segments/0/channels/x.dat", data, true)
        .finish()
}

fn refusal(name: &str, bytes: &[u8]) -> afmid_formats::FormatError {
    open_bytes::<JpkForce>(name, bytes).1.expect_err("must be refused")
}

#[test]
fn both_layouts_packed_or_not_give_the_same_channels() {
    for (name, bytes) in [("v1", version_1(true)), ("v1-stored", version_1(false)), ("v2", version_2())] {
        // for check_jpk.py
        std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.jpk-force")), &bytes).unwrap();
        assert!(JpkForce::recognises(&bytes, Path::new("x")), "by its entries' names");
        let (_folder, contents) = open_bytes::<JpkForce>("curve.jpk-force", &bytes);
        let contents = contents.unwrap();
        assert_eq!(contents.remarks, [""; 0], "{name}");
        assert_eq!(contents.started_at, "2016-02-05T13:27:32+01:00");
        assert!(contents.format.starts_with("JPK force curve 0.13"));
        assert_eq!(contents.channels.len(), 12);
        let raw = channel(&contents, "/segments/0/vDeflection");
        assert_eq!(raw.source.read(0, 5).unwrap(), Raw::Int16(SHORTS.to_vec()));
        assert_eq!(raw.source.read(1, 2).unwrap(), Raw::Int16(vec![-2, 30_000]));
        assert_eq!(
            (raw.unit.as_str(), raw.scale_factor, raw.add_offset),
            ("V", 3.0921021713588157E-4, -0.00728873489143207)
        );
        assert_eq!((raw.sample_rate_hz, raw.samples, raw.stored_as), (Some(20.0), 5, "int16"));
        assert_eq!(raw.long_name, "vDeflection, extend");
        assert_eq!(channel(&contents, "/segments/1/height").source.read(0, 5).unwrap(), Raw::Int32(INTEGERS.to_vec()));
        // afmformats 0.18.7 on the same bytes, see check_jpk.py
        for (location, wanted) in AFMFORMATS {
            let c = channel(&contents, location);
            for (found, wanted) in values(c).into_iter().zip(wanted) {
                near(found, wanted, 1e-12); // the chain is one line here and several there
            }
        }
        assert_eq!(channel(&contents, "/segments/0/vDeflection/force").unit, "N");
        assert_eq!(channel(&contents, "/segments/0/vDeflection/distance").unit, "m");
    }
}

#[test]
fn every_encoder_is_read_big_endian() {
    let encoders: [(&str, &[u8], [f64; 2], &str); 8] = [
        ("encoder.type=signedshort", &[0xff, 0xfe, 1, 2], [-2.0, 258.0], "int16"),
        ("encoder.type=unsignedshort-limited", &[0xff, 0xfe, 1, 2], [65534.0, 258.0], "uint16"),
        ("encoder.type=signedinteger", &[0xff, 0xff, 0xff, 0xfe, 0, 0, 1, 2], [-2.0, 258.0], "int32"),
        ("encoder.type=unsignedinteger", &[0xff, 0xff, 0xff, 0xfe, 0, 0, 1, 2], [4_294_967_294.0, 258.0], "uint32"),
        (
            "encoder.type=signedlong",
            &[255, 255, 255, 255, 255, 255, 255, 254, 0, 0, 0, 0, 0, 0, 1, 2],
            [-2.0, 258.0],
            "int64",
        ),
        (
            "encoder.type=unsignedlong",
            &[0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2],
            [9_223_372_036_854_775_808.0, 258.0],
            "uint64",
        ),
        ("type=float-data", &[0x3f, 0x80, 0, 0, 0xbf, 0, 0, 0], [1.0, -0.5], "float32"),
        ("type=double", &[0x3f, 0xf0, 0, 0, 0, 0, 0, 0, 0xbf, 0xe0, 0, 0, 0, 0, 0, 0], [1.0, -0.5], "float64"),
    ];
    for (encoder, data, wanted, stored_as) in encoders {
        let scaling = "channel.x.data.encoder.scaling.multiplier=2\nchannel.x.data.encoder.scaling.offset=1\n";
        let (_folder, contents) =
            open_bytes::<JpkForce>("c.jpk-force", &one(&format!("channel.x.data.{encoder}\n{scaling}"), data));
        let contents = contents.unwrap();
        let c = channel(&contents, "/segments/0/x");
        assert_eq!((codes(c), c.stored_as, c.sample_rate_hz), (wanted.to_vec(), stored_as, Some(4.0)), "{encoder}");
        assert_eq!(c.scale_factor, if encoder.starts_with("type") { 1.0 } else { 2.0 }, "{encoder}");
    }
}

#[test]
fn what_is_no_channel_of_numbers_is_remarked() {
    let scaling = "channel.x.data.encoder.type=signedshort\nchannel.x.data.encoder.scaling.multiplier=2\n\
        channel.x.data.encoder.scaling.offset=1\n";
    let remark =
        |properties: String, data: &[u8]| open_bytes::<JpkForce>("c.jpk-force", &one(&properties, data)).1.unwrap();
    let cases = [
        ("channel.x.data.type=constant-data\nchannel.x.data.value=3\n".to_owned(), "computed (constant-data, value 3)"),
        ("channel.x.data.type=short\n".to_owned(), "its type is `short` without an encoder"),
        (scaling.replace("signedshort", "morse"), "its encoder is `morse`"),
        (scaling.replace("multiplier=2", "multiplier=two"), "its multiplier is `two`, no number"),
        (scaling.replace("multiplier=2", "multiplier=0"), "its multiplier is 0"),
        (scaling.replace("channel.x.data.encoder.scaling.offset=1\n", ""), "its offset is missing"),
        (format!("{scaling}channel.x.data.encoder.scaling.type=cubic\n"), "its scaling is cubic"),
        (format!("{scaling}channel.x.data.file.name=channels/y.dat\n"), "no entry `segments/0/channels/y.dat`"),
    ];
    for (properties, what) in cases {
        let contents = remark(properties, &[0, 1, 0, 2]);
        assert!(contents.channels.is_empty() && remarked(&contents, what), "{what}: {:?}", contents.remarks);
    }
    let short = remark(scaling.to_owned(), &[0, 1, 0]);
    let said = "/segments/0/x is left out: found 3 bytes, that is 1 samples of int16; its segment announces 2";
    assert!(short.channels.is_empty() && remarked(&short, said), "{:?}", short.remarks);
    // twice the points, or points of twice the width: left out; other numbers of points: no rate
    let wide = remark(scaling.to_owned(), &[0; 8]);
    assert!(wide.channels.is_empty() && remarked(&wide, "4 samples of int16; its segment announces 2"));
    let more = remark(scaling.to_owned(), &[0; 6]);
    assert_eq!((more.channels[0].samples, more.channels[0].sample_rate_hz), (3, None));
    assert!(remarked(&more, "/segments/0/x: no sample rate: found 6 bytes"), "{:?}", more.remarks);
    let other = remark(format!("{scaling}channel.x.data.type=integer-data\n"), &[0; 4]);
    assert!(other.channels.is_empty() && remarked(&other, "its type is `integer-data` and its encoder `signedshort`"));
    let timeless = remark(format!("{scaling}force-segment-header.duration=0\n"), &[0, 1, 0, 2]);
    assert!(timeless.channels[0].sample_rate_hz.is_none() && remarked(&timeless, "no sample rate"));

    let set = "channel.x.conversion-set.conversion";
    let circle = format!(
        "{scaling}{set}s.base=volts\n{set}s.list=a b c\n{set}.b.defined=false\n{set}.c.scaling.type=cubic\n\
         {set}.a.base-calibration-slot=a\n{set}.a.scaling.multiplier=2\n{set}.a.scaling.offset=0\n"
    );
    let contents = remark(circle, &[0, 1, 0, 2]);
    assert_eq!(contents.channels.len(), 1);
    for what in
        ["does not lead to `volts`", "has no calibration `b`", "calibration `c` is left out: its scaling is cubic"]
    {
        assert!(remarked(&contents, what), "{what}: {:?}", contents.remarks);
    }
}

#[test]
fn maps_hold_curves_one_behind_the_other() {
    let map = curves(&[("index/0/", 2), ("index/10/", 1)]);
    let (_folder, contents) = open_bytes::<JpkForce>("map.jpk-force-map", &map);
    let contents = contents.unwrap();
    assert!(contents.format.starts_with("JPK map of 2 force curves 0.13"), "{}", contents.format);
    let base = ["/index/0/segments/0", "/index/0/segments/1", "/index/10/segments/0"];
    for folder in base {
        let c = channel(&contents, &format!("{folder}/vDeflection"));
        assert_eq!((c.samples, c.sample_rate_hz), (5, Some(20.0)), "{folder}");
        assert_eq!(values(c), values(channel(&contents, "/index/0/segments/0/vDeflection")));
    }
    assert_eq!(contents.channels.len(), 18);
}

#[test]
fn other_archives_are_refused() {
    assert!(
        refusal("m.zip", &Zip::default().add("a", b"", true).finish())
            .problem
            .contains("without `segments/0/segment-header.properties`")
    );
    assert!(refusal("m.jpk-force", b"PK\x03\x04 nothing more").problem.contains("the archive cannot be read"));
    let many: String = (0..300).map(|i| format!("c{i} ")).collect();
    assert!(
        refusal("c.jpk-force", &one(&format!("channels.list={many}\n"), b"")).problem.contains("found 300 channels")
    );
    assert!(refusal("c.jpk-force", &one(&" ".repeat(1 << 21), b"")).problem.contains("wanted at most 1048576"));
    let sound = version_1(true);
    assert!(refusal("c.jpk-force", &sound[..sound.len() / 2]).problem.contains("the archive cannot be read"));
}

#[test]
fn samples_that_do_not_unpack_are_refused_when_read() {
    let mut bytes = version_1(true);
    let name = b"segments/1/channels/height.dat";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    bytes[at + 3] ^= 0x55;
    let (_folder, contents) = open_bytes::<JpkForce>("c.jpk-force", &bytes);
    let contents = contents.unwrap();
    let error = channel(&contents, "/segments/1/height").source.read(0, 1).unwrap_err();
    // what the damaged bytes inflate to is another number of bytes, or has another checksum
    assert!(error.problem.contains("data") && error.at_byte.is_some_and(|byte| byte >= at as u64), "{error:?}");
    assert_eq!(codes(channel(&contents, "/segments/0/height")).len(), 5);
}

#[test]
fn damaged_archives_never_panic() {
    // each of 12 channels reads at most what deflate can make of the file
    for bytes in [version_1(true), version_1(false), version_2()] {
        survive::<JpkForce>("c.jpk-force", &bytes, 300, 2000, bytes.len() * 12);
    }
}

/// afmformats 0.18.7: `JPKReader(path).get_data("force", 0, segment)` and `"height (piezo)"`, the same for all three
/// files.
const AFMFORMATS: [(&str, [f64; 5]); 4] = [
    ("/segments/0/vDeflection/force", FORCE),
    ("/segments/1/vDeflection/force", FORCE),
    ("/segments/0/height/calibrated", HEIGHT),
    ("/segments/1/height/calibrated", HEIGHT),
];
const FORCE: [f64; 5] = [
    2.2243672167421697e-11,
    1.941939015409129e-11,
    2.8264122378133752e-08,
    -2.8221517888474465e-08,
    2.7892236194082523e-11,
];
const HEIGHT: [f64; 5] = [
    2.2243672167421697e-11,
    1.941939015409129e-11,
    1.8828759777984372e-06,
    -1.8828333733087774e-06,
    2.7892236194082523e-11,
];
