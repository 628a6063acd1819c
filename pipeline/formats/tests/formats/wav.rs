//! WAV files: written by SciPy, built here, and as the crate hound reads them.

use crate::support::{Temporary, codes, locations, open, remarked, values, written};
use afmid_formats::readers::wav::Wav;
use afmid_formats::{Contents, Format};

/// The decay of tests/make_wav.py.
fn decay() -> Vec<f64> {
    (0..64).map(f64::from).map(|n| (-n / 20.0).exp() * (n / 3.0).cos()).collect()
}

#[test]
fn files_of_scipy_have_their_samples_and_rate() {
    // half a code of each width, and what 127 / 128 or 32767 / 32768 leave of full scale
    for (name, tolerance) in [("u1", 1.5 / 128.0), ("i2", 1.5 / 32768.0), ("i4", 1e-9), ("f4", 1e-7), ("f8", 1e-15)] {
        let contents = Wav::open(&written(&format!("{name}.wav"))).unwrap();
        assert_eq!(locations(&contents), ["/channel[0]", "/channel[1]"], "{name}");
        for (channel, sign) in contents.channels.iter().zip([1.0, -1.0]) {
            assert_eq!((channel.sample_rate_hz, channel.unit.as_str()), (Some(8000.0), ""), "{name}");
            let found = values(channel);
            assert_eq!(found.len(), 64);
            let off = found.iter().zip(decay()).map(|(found, truth)| (found - sign * truth).abs()).fold(0.0, f64::max);
            assert!(off <= tolerance, "{name}: {off}");
        }
    }
}

#[test]
fn hound_reads_the_same_codes() {
    for name in ["u1", "i2", "i4", "mono_i2"] {
        let contents = Wav::open(&written(&format!("{name}.wav"))).unwrap();
        let mut hound = hound::WavReader::open(written(&format!("{name}.wav"))).unwrap();
        assert_eq!(contents.channels[0].sample_rate_hz, Some(f64::from(hound.spec().sample_rate)));
        let all: Vec<f64> = hound.samples::<i32>().map(|code| f64::from(code.unwrap())).collect();
        for (number, channel) in contents.channels.iter().enumerate() {
            // hound takes 128 off the unsigned codes of 8 bits
            let zero = if name == "u1" { 128.0 } else { 0.0 };
            let found: Vec<f64> = codes(channel).into_iter().map(|code| code - zero).collect();
            let wanted: Vec<f64> = all.iter().copied().skip(number).step_by(contents.channels.len()).collect();
            assert_eq!(found, wanted, "{name}");
        }
    }
    let contents = Wav::open(&written("f4.wav")).unwrap();
    let mut hound = hound::WavReader::open(written("f4.wav")).unwrap();
    let all: Vec<f64> = hound.samples::<f32>().map(|value| f64::from(value.unwrap())).collect();
    assert_eq!(codes(&contents.channels[0]), all.iter().copied().step_by(2).collect::<Vec<f64>>());
}

/// Why hound is not the reader: what it refuses and we read.
#[test]
fn hound_refuses_double_precision_and_stops_at_a_cut() {
    assert!(hound::WavReader::open(written("f8.wav")).is_err());
    let whole = std::fs::read(written("i2.wav")).unwrap();
    let cut = Temporary::new("wav", &whole[..whole.len() - 10]);
    let read: Result<Vec<i16>, _> = hound::WavReader::open(&cut.0).unwrap().samples::<i16>().collect();
    assert!(read.is_err());
    let contents = Wav::open(&cut.0).unwrap();
    // ten bytes are two frames and a half
    assert_eq!(contents.channels[0].samples, 61);
    assert!(remarked(&contents, "the file is cut off: its header says 256 bytes of samples, there are 246"));
    assert!(remarked(&contents, "the last 2 bytes are no whole frame of 4 bytes"));
}

fn chunk(name: &[u8; 4], bytes: &[u8], big: bool) -> Vec<u8> {
    let size = bytes.len() as u32;
    let size = if big { size.to_be_bytes() } else { size.to_le_bytes() };
    let mut out = [&name[..], &size, bytes].concat();
    out.resize(out.len().next_multiple_of(2), 0);
    out
}

fn format(tag: u16, channels: u16, rate: u32, bits: u16, big: bool) -> Vec<u8> {
    let frame = channels * bits / 8;
    let mut out = Vec::new();
    let put16 = |out: &mut Vec<u8>, word: u16| out.extend(if big { word.to_be_bytes() } else { word.to_le_bytes() });
    [tag, channels].into_iter().for_each(|word| put16(&mut out, word));
    for long in [rate, rate * u32::from(frame)] {
        out.extend(if big { long.to_be_bytes() } else { long.to_le_bytes() });
    }
    [frame, bits].into_iter().for_each(|word| put16(&mut out, word));
    out
}

fn file(mark: &[u8; 4], chunks: &[Vec<u8>]) -> Vec<u8> {
    let inside = [b"WAVE".to_vec(), chunks.concat()].concat();
    chunk(mark, &inside, mark == b"RIFX")
}

fn first(bytes: &[u8]) -> (Contents, Vec<f64>) {
    let contents = open::<Wav>("built.wav", bytes).unwrap();
    let values = values(&contents.channels[0]);
    (contents, values)
}

#[test]
fn chunks_between_odd_sizes_and_24_bits() {
    let data = [0x00, 0x00, 0x80, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF];
    let list = chunk(b"LIST", b"odd", false);
    let (contents, values) = first(&file(
        b"RIFF",
        &[list, chunk(b"fmt ", &format(1, 1, 8000, 24, false), false), chunk(b"data", &data, false)],
    ));
    assert_eq!(values, [-1.0, 1.0 - 2_f64.powi(-23), -(2_f64.powi(-23))]);
    assert_eq!((contents.channels[0].stored_as, contents.channels[0].sample_rate_hz), ("int24", Some(8000.0)));
}

#[test]
fn big_endian_and_64_bit_files_are_read() {
    let big = [chunk(b"fmt ", &format(1, 1, 100, 16, true), true), chunk(b"data", &[0x40, 0, 0xC0, 0], true)];
    assert_eq!(first(&file(b"RIFX", &big)).1, [0.5, -0.5]);
    // RF64: the size of the samples is in ds64, that in data is unknown
    let sizes: Vec<u8> = [60_u64, 4, 2].into_iter().flat_map(u64::to_le_bytes).chain([0; 4]).collect();
    let mut data = chunk(b"data", &[0, 0x40, 0, 0xC0, 1, 2, 3, 4], false);
    data[4..8].copy_from_slice(&[0xFF; 4]);
    let long = [chunk(b"ds64", &sizes, false), chunk(b"fmt ", &format(1, 1, 100, 16, false), false), data];
    assert_eq!(first(&file(b"RF64", &long)).1, [0.5, -0.5]);
}

#[test]
fn a_size_that_was_never_written_means_to_the_end() {
    let mut data = chunk(b"data", &[0, 0x40, 0, 0xC0], false);
    data[4..8].copy_from_slice(&[0; 4]);
    let mut bytes = file(b"RIFF", &[chunk(b"fmt ", &format(1, 1, 100, 16, false), false), data]);
    bytes[4..8].copy_from_slice(&[0; 4]);
    let (contents, values) = first(&bytes);
    assert_eq!(values, [0.5, -0.5]);
    assert!(remarked(&contents, "does not say how many samples"));
}

#[test]
fn what_cannot_be_read_is_refused_with_the_reason() {
    let data = || chunk(b"data", &[0; 8], false);
    let described = |tag, bits| chunk(b"fmt ", &format(tag, 1, 8000, bits, false), false);
    let mut narrow = format(1, 2, 8000, 16, false);
    narrow[12] = 3;
    let cases = [
        (file(b"RIFF", &[described(2, 4), data()]), "Microsoft ADPCM"),
        (file(b"RIFF", &[described(1, 12), data()]), "samples of 12 bits"),
        (file(b"RIFF", &[described(3, 16), data()]), "wanted plain integers or floats"),
        (file(b"RIFF", &[data()]), "without a chunk fmt"),
        (file(b"RIFF", &[described(1, 16)]), "found no chunk data"),
        (file(b"RIFF", &[described(1, 16), chunk(b"data", &[], false)]), "found 0 bytes of data"),
        (file(b"RIFF", &[chunk(b"fmt ", &narrow, false), data()]), "found frames of 3 bytes, wanted 4"),
        (b"RIFF\0\0\0\0AVI ".to_vec(), "wanted a WAV file"),
    ];
    for (bytes, words) in cases {
        let error = open::<Wav>("refused.wav", &bytes).unwrap_err();
        assert!(error.problem.contains(words) && error.help.is_some() && error.at_byte.is_some(), "{words}: {error:?}");
    }
}

#[test]
fn bytes_per_second_that_contradict_the_rate_leave_it_unknown() {
    let mut about = format(1, 2, 8000, 16, false);
    about[8..12].copy_from_slice(&48_000_u32.to_le_bytes());
    let bytes = file(b"RIFF", &[chunk(b"fmt ", &about, false), chunk(b"data", &[0; 8], false)]);
    let (contents, _) = first(&bytes);
    assert_eq!(contents.channels[0].sample_rate_hz, None);
    assert!(remarked(&contents, "8000 frames of 4 bytes and 48000 bytes per second, wanted 32000"));
}

#[test]
fn rates_that_are_not_stated_are_unknown() {
    let bytes = file(b"RIFF", &[chunk(b"fmt ", &format(3, 1, 0, 32, false), false), chunk(b"data", &[0; 8], false)]);
    assert_eq!(first(&bytes).0.channels[0].sample_rate_hz, None);
}

/// A file of one channel of 32 bits; of the extensible form if valid bits are given.
fn words(valid_bits: Option<u16>, codes: &[i32]) -> (Contents, Vec<f64>) {
    let mut about = format(if valid_bits.is_some() { 0xFFFE } else { 1 }, 1, 8000, 32, false);
    if let Some(valid) = valid_bits {
        about.extend([22_u16, valid].into_iter().flat_map(u16::to_le_bytes));
        about.extend([0; 4]);
        about.extend([1, 0, 0, 0, 0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71]);
    }
    let data: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    first(&file(b"RIFF", &[chunk(b"fmt ", &about, false), chunk(b"data", &data, false)]))
}

#[test]
fn bits_at_the_lower_end_of_a_word_are_recognised_by_what_is_stated_and_by_the_peak() {
    const FULL: i32 = 1 << 23;
    let (lower, upper) = ("full scale is that of 24 bits", "the scale is uncertain");
    // valid bits, codes, bits of full scale, words of the remark
    type Case<'a> = (Option<u16>, &'a [i32], i32, Option<&'static str>);
    let cases: [Case<'_>; 13] = [
        (None, &[FULL - 1, -FULL, 3], 24, Some(lower)),
        (None, &[FULL / 2, 1], 24, Some(lower)),
        (Some(32), &[FULL / 2 + 5, 1], 24, Some(lower)),
        // a quiet signal of 32 bits, or of 24
        (None, &[FULL / 2 - 1, -5], 32, Some(upper)),
        (None, &[1, -1], 32, Some(upper)),
        (None, &[FULL, 3], 32, None),
        (None, &[-FULL - 1, 3], 32, None),
        // at the upper end: the lowest bits are 0
        (None, &[256, -512], 32, None),
        (None, &[0, 0], 32, None),
        (Some(24), &[256, -512], 32, None),
        // stated, and at the lower end however quiet
        (Some(24), &[257, -3], 24, Some(lower)),
        (Some(24), &[FULL, 3], 32, Some("the samples use more")),
        (Some(20), &[4097, -3], 20, Some("full scale is that of 20 bits")),
    ];
    for (valid, codes, bits, remark) in cases {
        let (contents, found) = words(valid, codes);
        let wanted: Vec<f64> = codes.iter().map(|code| f64::from(*code) * 2_f64.powi(1 - bits)).collect();
        assert_eq!(found, wanted, "{valid:?} {codes:?}");
        let said = contents.remarks.iter().filter(|remark| !remark.contains("states no unit")).collect::<Vec<_>>();
        assert_eq!(said.len(), usize::from(remark.is_some()), "{said:?}");
        assert!(remark.is_none_or(|words| said[0].contains(words)), "{said:?}");
    }
    // the last of many decides
    let mut long = vec![FULL - 1; 300_000];
    *long.last_mut().unwrap() = FULL;
    assert_eq!(words(None, &long).1[0], f64::from(FULL - 1) / 2_f64.powi(31));
}
