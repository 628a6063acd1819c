//! Igor binary waves: built byte by byte, real files against igor2, and damaged ones.

use std::path::Path;

use crate::support::*;
use afmid_formats::readers::igor::IgorWave;
use afmid_formats::{Format, Raw};

/// A wave to write; fields as in Igor's headers.
#[derive(Clone)]
struct Wave {
    version: u16,
    big: bool,
    kind: u16,
    dims: [u32; 4],
    step: f64,
    start: f64,
    x_unit: &'static str,
    unit: &'static str,
    /// Samples in file order, already in the right byte order.
    data: Vec<u8>,
    note: &'static str,
    formula: &'static str,
    long_unit: &'static str,
    long_x_unit: &'static str,
    labels: Vec<&'static str>,
}

impl Default for Wave {
    fn default() -> Self {
        Self {
            version: 5,
            big: false,
            kind: 2,
            dims: [3, 0, 0, 0],
            step: 1e-3,
            start: 0.0,
            x_unit: "s",
            unit: "V",
            data: floats(&[1.0, -2.0, 0.5], false),
            note: "",
            formula: "",
            long_unit: "",
            long_x_unit: "",
            labels: Vec::new(),
        }
    }
}

fn floats(values: &[f32], big: bool) -> Vec<u8> {
    values.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }).collect()
}

struct Writer {
    bytes: Vec<u8>,
    big: bool,
}

impl Writer {
    fn put(&mut self, at: usize, little: &[u8]) {
        let mut word = little.to_vec();
        if self.big {
            word.reverse();
        }
        self.bytes[at..at + word.len()].copy_from_slice(&word);
    }
    fn u16(&mut self, at: usize, v: u16) {
        self.put(at, &v.to_le_bytes());
    }
    fn u32(&mut self, at: usize, v: u32) {
        self.put(at, &v.to_le_bytes());
    }
    fn f64(&mut self, at: usize, v: f64) {
        self.put(at, &v.to_le_bytes());
    }
    fn text(&mut self, at: usize, v: &str) {
        self.bytes[at..at + v.len()].copy_from_slice(v.as_bytes());
    }
    fn seal(&mut self, at: usize, header: usize) {
        let word =
            |c: &[u8]| if self.big { u16::from_be_bytes([c[0], c[1]]) } else { u16::from_le_bytes([c[0], c[1]]) };
        let sum = self.bytes[..header].chunks(2).fold(0_u16, |s, c| s.wrapping_add(word(c)));
        self.u16(at, 0_u16.wrapping_sub(sum));
    }
}

impl Wave {
    fn bytes(&self) -> Vec<u8> {
        if self.version == 5 { self.version_5() } else { self.older() }
    }

    fn version_5(&self) -> Vec<u8> {
        let mut w = Writer { bytes: vec![0; 384], big: self.big };
        w.u16(0, 5);
        w.u32(4, 320 + self.data.len() as u32);
        for (at, part) in [(8, self.formula), (12, self.note), (16, self.long_unit), (20, self.long_x_unit)] {
            w.u32(at, part.len() as u32);
        }
        let labels = if self.labels.is_empty() { 0 } else { 32 * (self.labels.len() as u32 + 1) };
        w.u32(40, labels);
        w.u32(68, 3_001_252_180);
        w.u32(76, self.dims.iter().filter(|&&n| n > 0).product::<u32>() * u32::from(self.dims[0] > 0));
        w.u16(80, self.kind);
        w.text(92, "wave0");
        for (i, n) in self.dims.into_iter().enumerate() {
            w.u32(132 + 4 * i, n);
        }
        w.f64(148, self.step);
        w.f64(180, self.start);
        w.text(212, self.unit);
        w.text(216, self.x_unit);
        w.seal(2, 384);
        w.bytes.extend(&self.data);
        for part in [self.formula, self.note, self.long_unit, self.long_x_unit] {
            w.bytes.extend(part.as_bytes());
        }
        if labels > 0 {
            w.bytes.extend([0; 32]);
        }
        for label in &self.labels {
            let mut field = label.as_bytes().to_vec();
            field.resize(32, 0);
            w.bytes.extend(field);
        }
        w.bytes
    }

    fn older(&self) -> Vec<u8> {
        let (start, checksum) = match self.version {
            1 => (8, 6),
            2 => (16, 14),
            _ => (20, 18),
        };
        let mut w = Writer { bytes: vec![0; start + 110], big: self.big };
        w.u16(0, self.version);
        w.u32(2, 126 + self.data.len() as u32);
        if self.version >= 2 {
            w.u32(6, self.note.len() as u32);
        }
        if self.version == 3 {
            w.u32(10, self.formula.len() as u32);
        }
        w.u16(start, self.kind);
        w.text(start + 6, "wave0");
        w.text(start + 34, self.unit);
        w.text(start + 38, self.x_unit);
        w.u32(start + 42, self.dims[0]);
        w.f64(start + 48, self.step);
        w.f64(start + 56, self.start);
        w.u32(start + 96, 3_001_252_180);
        w.bytes.extend(&self.data);
        w.bytes.extend([0; 16]);
        // the sum covers the first 16 bytes of samples, as real files of version 2 show
        w.seal(checksum, start + 126);
        w.bytes.extend(self.note.as_bytes());
        w.bytes.extend(self.formula.as_bytes());
        w.bytes
    }
}

fn refusal(bytes: &[u8]) -> afmid_formats::FormatError {
    open_bytes::<IgorWave>("wave0.ibw", bytes).1.expect_err("must be refused")
}

#[test]
fn every_version_in_both_byte_orders_gives_the_same_channel() {
    for version in [1, 2, 3, 5] {
        for big in [false, true] {
            let wave = Wave {
                version,
                big,
                data: floats(&[1.0, -2.0, 0.5], big),
                note: if version == 1 { "" } else { "a note" },
                ..Wave::default()
            };
            let bytes = wave.bytes();
            assert!(IgorWave::recognises(&bytes, Path::new("x.bin")), "by its checksum");
            let (_folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &bytes);
            let contents = contents.unwrap();
            let c = channel(&contents, "/wave0");
            assert_eq!((c.samples, c.unit.as_str(), c.stored_as), (3, "V", "float32"));
            near(c.sample_rate_hz.unwrap(), 1000.0, 1e-12); // rounding of 1/1e-3
            assert_eq!(codes(c), [1.0, -2.0, 0.5]);
            assert_eq!(c.source.read(1, 1).unwrap(), Raw::Float32(vec![-2.0]));
            assert_eq!(contents.started_at, "1999-02-07T17:09:40");
            assert_eq!(remarked(&contents, "note: a note"), version > 1);
            assert!(!remarked(&contents, "checksum"), "{:?}", contents.remarks);
        }
    }
}

#[test]
fn every_numeric_type_is_read_in_both_byte_orders() {
    let cases: [(u16, &[u8], &[f64], &str); 10] = [
        (0x08, &[0xff, 0x7f], &[-1.0, 127.0], "int8"),
        (0x48, &[0xff, 0x7f], &[255.0, 127.0], "uint8"),
        (0x10, &[0xfe, 0xff, 0x02, 0x01], &[-2.0, 258.0], "int16"),
        (0x50, &[0xfe, 0xff, 0x02, 0x01], &[65534.0, 258.0], "uint16"),
        (0x20, &[0xfe, 0xff, 0xff, 0xff, 1, 0, 1, 0], &[-2.0, 65537.0], "int32"),
        (0x60, &[0xfe, 0xff, 0xff, 0xff, 1, 0, 1, 0], &[4_294_967_294.0, 65537.0], "uint32"),
        (
            0x80,
            &[0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0, 1, 0, 0, 0],
            &[-2.0, 4_294_967_297.0],
            "int64",
        ),
        (
            0xC0,
            &[0, 0, 0, 0, 0, 0, 0, 0x80, 1, 0, 0, 0, 1, 0, 0, 0],
            &[9_223_372_036_854_775_808.0, 4_294_967_297.0],
            "uint64",
        ),
        (0x02, &[0, 0, 0x80, 0x3f, 0, 0, 0, 0xbf], &[1.0, -0.5], "float32"),
        (0x04, &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0, 0, 0, 0, 0, 0xe0, 0xbf], &[1.0, -0.5], "float64"),
    ];
    for (kind, little, wanted, name) in cases {
        for big in [false, true] {
            let mut data = little.to_vec();
            if big {
                data.chunks_mut(little.len() / 2).for_each(<[u8]>::reverse);
            }
            let (_folder, contents) = open_bytes::<IgorWave>(
                "wave0.ibw",
                &Wave { kind, big, data, dims: [2, 0, 0, 0], ..Wave::default() }.bytes(),
            );
            let contents = contents.unwrap();
            let c = channel(&contents, "/wave0");
            assert_eq!((c.stored_as, codes(c)), (name, wanted.to_vec()), "type {kind:#x}, big-endian {big}");
        }
    }
}

#[test]
fn columns_are_channels_by_label_or_index() {
    let data = floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], false);
    let labelled =
        Wave { dims: [2, 3, 0, 0], data: data.clone(), labels: vec!["Raw", "Defl", "Raw"], ..Wave::default() };
    let (_folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &labelled.bytes());
    let contents = contents.unwrap();
    assert_eq!(codes(channel(&contents, "/Defl")), [3.0, 4.0]);
    assert_eq!(channel(&contents, "/Defl").long_name, "wave0, Defl");
    // a label that two columns have locates neither
    assert_eq!(codes(channel(&contents, "/wave0[0]")), [1.0, 2.0]);
    assert_eq!(codes(channel(&contents, "/wave0[2]")), [5.0, 6.0]);

    let layers = Wave { dims: [1, 2, 3, 0], data, ..Wave::default() };
    let (_folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &layers.bytes());
    let contents = contents.unwrap();
    assert_eq!(contents.channels.len(), 6);
    assert_eq!(codes(channel(&contents, "/wave0[4]")), [5.0]);
}

#[test]
fn scaling_units_and_rate_come_from_the_header_before_the_note() {
    let asylum = "NumPtsPerSec: 2000\rInvOLS: 1e-07\rSpringConstant: 0.02\rSeconds:3539255520.083\r";
    let of = |wave: Wave| open_bytes::<IgorWave>("wave0.ibw", &wave.bytes()).1.unwrap();
    let rate = |wave| of(wave).channels[0].sample_rate_hz;

    assert_eq!(rate(Wave { x_unit: "ms", step: 0.5, ..Wave::default() }), Some(2000.0));
    assert_eq!(rate(Wave { x_unit: "m", ..Wave::default() }), None);
    assert_eq!(rate(Wave { x_unit: "", ..Wave::default() }), None);
    assert_eq!(rate(Wave { x_unit: "", note: asylum, ..Wave::default() }), Some(2000.0));
    assert_eq!(rate(Wave { step: 0.0, note: asylum, ..Wave::default() }), Some(2000.0));
    assert_eq!(rate(Wave { step: f64::NAN, ..Wave::default() }), None);
    assert_eq!(rate(Wave { step: -1.0, ..Wave::default() }), None);

    let contradicted = of(Wave { note: asylum, step: 1e-4, start: 2.5, ..Wave::default() });
    assert!(
        remarked(&contradicted, "NumPtsPerSec 2000: the former is used")
            && remarked(&contradicted, "time starts at 2.5 s")
    );
    assert!(
        remarked(&contradicted, "InvOLS (deflection sensitivity) is 0.0000001 m/V")
            && remarked(&contradicted, "SpringConstant is 0.02 N/m")
    );
    // datetime(1904, 1, 1) + timedelta(seconds=3539255520)
    assert_eq!(contradicted.started_at, "2016-02-25T14:32:00");

    let columns =
        Wave { dims: [1, 3, 0, 0], labels: vec!["Defl", "DeflV", "Other"], unit: "", note: asylum, ..Wave::default() };
    let units: Vec<_> = of(columns.clone()).channels.into_iter().map(|c| c.unit).collect();
    assert_eq!(units, ["m", "V", ""]);
    let units: Vec<_> = of(Wave { note: "", ..columns }).channels.into_iter().map(|c| c.unit).collect();
    assert_eq!(units, ["", "", ""]);

    let long = of(Wave { unit: "", x_unit: "", long_unit: "volts", long_x_unit: "sec", ..Wave::default() });
    assert_eq!((long.channels[0].unit.as_str(), long.channels[0].sample_rate_hz.is_some()), ("volts", true));
}

#[test]
fn what_is_no_channel_is_remarked_or_refused() {
    let of = |wave: Wave| open_bytes::<IgorWave>("wave0.ibw", &wave.bytes()).1.unwrap();
    let dependent = of(Wave { version: 3, data: Vec::new(), formula: "K0*2", ..Wave::default() });
    assert!(dependent.channels.is_empty() && remarked(&dependent, "`K0*2`") && remarked(&dependent, "were not saved"));
    assert_eq!(of(Wave { version: 3, formula: "K0", ..Wave::default() }).channels.len(), 1, "saved samples are read");
    for (kind, what) in [(0, "text wave"), (0x100, "data folder references"), (0x4000, "wave references")] {
        let other = of(Wave { kind, ..Wave::default() });
        assert!(other.channels.is_empty() && remarked(&other, what));
    }
    let (_folder, empty) =
        open_bytes::<IgorWave>("wave0.ibw", &Wave { dims: [0; 4], data: Vec::new(), ..Wave::default() }.bytes());
    let empty = empty.unwrap();
    assert!(empty.channels[0].samples == 0 && remarked(&empty, "no points"));
    assert_eq!(codes(&empty.channels[0]), Vec::<f64>::new());

    let complex = refusal(&Wave { kind: 3, ..Wave::default() }.bytes());
    assert!(complex.problem.contains("complex") && complex.at_byte == Some(80) && complex.help.is_some());
    assert!(refusal(&Wave { kind: 0x40, ..Wave::default() }.bytes()).problem.contains("found type 0x40"));
    assert!(
        refusal(&Wave { dims: [1, 5000, 0, 0], data: floats(&[0.0; 5000], false), ..Wave::default() }.bytes())
            .problem
            .contains("5000 columns")
    );
    assert!(refusal(b"\x07\x00 something").problem.contains("wanted version 1, 2, 3 or 5"));
    assert!(refusal(b"").problem.contains("empty file"));
    let packed = open_bytes::<IgorWave>("all.pxp", &[8, 0, 0, 0, 1, 2, 3, 4]).1.unwrap_err();
    assert!(packed.problem.contains("packed experiment") && packed.help.unwrap().contains("Save Waves"));
    assert!(IgorWave::open(Path::new("/nowhere/x.ibw")).unwrap_err().problem.contains("cannot be opened"));
    assert!(IgorWave::open(Path::new("/")).unwrap_err().problem.contains("a file was wanted"));
}

#[test]
fn lengths_that_lie_are_refused_with_the_byte() {
    let sound = Wave { note: "a note", ..Wave::default() }.bytes();
    let with = |at: usize, value: i32| {
        let mut bytes = sound.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    assert_eq!(refusal(&with(4, -1)).at_byte, Some(4));
    assert!(refusal(&with(4, 320)).problem.contains("room for 0 bytes"));
    // three points of four bytes in room for three of eight
    assert!(refusal(&with(4, 344)).problem.contains("found 24 bytes of samples, wanted 12 for 3 points of float32"));
    assert!(refusal(&with(132, 4)).problem.contains("wanted a product of 3 points"));
    assert!(refusal(&with(76, 1 << 30)).problem.contains("product"));
    let mut huge = with(76, 1 << 30);
    huge[132..136].copy_from_slice(&(1_i32 << 30).to_le_bytes());
    assert!(refusal(&huge).problem.contains("room for"));
    huge[4..8].copy_from_slice(&i32::MAX.to_le_bytes());
    assert!(refusal(&huge).problem.contains("wanted 4294967296") || refusal(&huge).problem.contains("room for"));
    assert!(refusal(&sound[..390]).problem.contains("end of the file at byte 390"));
    assert!(refusal(&sound[..100]).problem.contains("header"));
    // samples are whole, the note is not
    let (_folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &sound[..sound.len() - 1]);
    assert!(remarked(&contents.unwrap(), "left out the note"));
    let (_folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &with(148, 7));
    assert!(remarked(&contents.unwrap(), "checksum"));
}

#[test]
fn a_file_that_grows_after_opening_is_noticed() {
    let bytes = Wave::default().bytes();
    let (folder, contents) = open_bytes::<IgorWave>("wave0.ibw", &bytes);
    std::fs::write(folder.path().join("wave0.ibw"), [bytes, vec![0]].concat()).unwrap();
    assert!(contents.unwrap().channels[0].source.read(0, 1).unwrap_err().problem.contains("when it was opened"));
}

#[test]
fn small_real_waves_are_as_igor2_reads_them() {
    // igor2 0.5.15: binarywave.load(f)["wave"]["wData"] is [5, 4, 3, 2, 1] in each; dates by datetime(1904, 1, 1) +
    // creationDate
    let cases = [
        ("mac-version5", "/version5", "float32", "Igor binary wave 5, big-endian", "1999-02-07T17:09:40"),
        ("win-version5", "/version5", "float32", "Igor binary wave 5, little-endian", "1999-02-07T17:09:40"),
        ("win-version2", "/version2", "float32", "Igor binary wave 2, little-endian", "1999-02-07T17:06:19"),
        ("win-double", "/double", "float64", "Igor binary wave 2, little-endian", "1999-02-11T14:24:02"),
    ];
    for (file, location, stored_as, format, started_at) in cases {
        let Some(path) = real(&format!("ibw/{file}.ibw")) else { return };
        let contents = IgorWave::open(&path).unwrap();
        let c = channel(&contents, location);
        assert_eq!(codes(c), [5.0, 4.0, 3.0, 2.0, 1.0], "{file}");
        assert_eq!((c.stored_as, c.unit.as_str(), c.sample_rate_hz), (stored_as, "", None), "{file}");
        assert_eq!((contents.format.as_str(), contents.started_at.as_str()), (format, started_at), "{file}");
        assert_eq!(remarked(&contents, "note: This is a test."), file != "win-double", "{file}");
        assert!(!remarked(&contents, "checksum"), "{file}: {:?}", contents.remarks);
    }
}

#[test]
fn real_waves_without_samples_say_why() {
    let (Some(dependent), Some(zero), Some(text)) =
        (real("ibw/mac-version3Dependent.ibw"), real("ibw/mac-zeroPointWave.ibw"), real("ibw/win-textWave.ibw"))
    else {
        return;
    };
    // igor2: npnts 10, formula b' K0', wData of shape (0,)
    let contents = IgorWave::open(&dependent).unwrap();
    assert!(contents.channels.is_empty() && remarked(&contents, "K0") && remarked(&contents, "the 10 samples"));
    assert_eq!(contents.started_at, "", "creationDate is 0");
    // igor2: npnts 0, bname zeroWave
    let contents = IgorWave::open(&zero).unwrap();
    assert!(channel(&contents, "/zeroWave").samples == 0 && remarked(&contents, "no points"));
    // igor2: type 0, bname text0
    let contents = IgorWave::open(&text).unwrap();
    assert!(contents.channels.is_empty() && remarked(&contents, "wave `text0` is a text wave"));
}

#[test]
fn an_asylum_force_curve_is_as_igor2_reads_it() {
    let Some(path) = real("ibw/IgorIBWReader_ForceCurve.ibw") else { return };
    let contents = IgorWave::open(&path).unwrap();
    // igor2 0.5.15: shape (1261, 3), labels Raw, Defl, ZSnsr, dataUnits m, dimUnits s, sfA 5e-4; per column of wData:
    // astype(float64).sum() and samples 0, 1, 500, 1260
    let columns = [
        (
            "/Raw",
            0.0061165791548773996,
            [4.897351573163178e-06, 4.897762664768379e-06, 4.886139322479721e-06, 4.733953574032057e-06],
        ),
        (
            "/Defl",
            -0.0003419128072152944,
            [-2.700917889342236e-07, -2.7008485403712257e-07, -2.717034988108935e-07, -2.722796352827572e-07],
        ),
        (
            "/ZSnsr",
            0.006116578664205008,
            [4.897278358839685e-06, 4.8975493882608134e-06, 4.886187525698915e-06, 4.73379077448044e-06],
        ),
    ];
    assert_eq!(contents.channels.len(), 3);
    for (location, sum, samples) in columns {
        let c = channel(&contents, location);
        let codes = codes(c);
        near(codes.iter().sum(), sum, 1e-12); // order of the additions differs
        assert_eq!([0, 1, 500, 1260].map(|i| codes[i]), samples, "{location}");
        assert_eq!((c.samples, c.unit.as_str(), c.stored_as), (1261, "m", "float32"));
        near(c.sample_rate_hz.unwrap(), 2000.0, 1e-12); // rounding of 1/5e-4
    }
    // note: Seconds:3539255520.083; creationDate 3563961474
    assert_eq!(contents.started_at, "2016-02-25T14:32:00");
    assert!(remarked(&contents, "2016-12-07T13:17:54"));
    assert!(
        remarked(&contents, "SpringConstant is 0.018189 N/m")
            && remarked(&contents, "InvOLS (deflection sensitivity) is 0.0000001 m/V")
    );
    assert!(!remarked(&contents, "checksum") && !remarked(&contents, "NumPtsPerSec"), "{:?}", contents.remarks);
}

#[test]
fn damaged_waves_never_panic() {
    for version in [1, 2, 3, 5] {
        for big in [false, true] {
            let wave = Wave {
                version,
                big,
                data: floats(&[1.0; 6], big),
                dims: if version == 5 { [2, 3, 0, 0] } else { [6, 0, 0, 0] },
                labels: vec!["a", "b", "c"],
                note: "NumPtsPerSec: 5\rInvOLS: 1e-7",
                formula: "K0",
                ..Wave::default()
            };
            let bytes = wave.bytes();
            survive::<IgorWave>("wave0.ibw", &bytes, 150, 500, bytes.len());
        }
    }
    for file in [
        "IgorIBWReader_ForceCurve",
        "mac-version3Dependent",
        "mac-version5",
        "mac-zeroPointWave",
        "win-double",
        "win-textWave",
        "win-version2",
        "win-version5",
    ] {
        let Some(path) = real(&format!("ibw/{file}.ibw")) else { return };
        let bytes = std::fs::read(path).unwrap();
        survive::<IgorWave>("wave.ibw", &bytes, 300, 1000, bytes.len());
    }
}
