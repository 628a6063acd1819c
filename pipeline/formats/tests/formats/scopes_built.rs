//! Waveforms of LeCroy, Keysight, Rigol and Tektronix that are built here.

use crate::scope_files::{Trace, bin_file, isf_file};
use crate::support::{channel, locations, open, remarked, values};
use afmid_formats::readers::keysight::Keysight;
use afmid_formats::readers::lecroy::LeCroy;
use afmid_formats::readers::tektronix::TektronixIsf;
use afmid_formats::{Contents, Format, FormatError};
use std::path::Path;

fn lecroy(trace: &Trace) -> Contents {
    let bytes = trace.file();
    assert!(LeCroy::recognises(&bytes, Path::new("x")));
    open::<LeCroy>("built.trc", &bytes).unwrap()
}

#[test]
fn lecroy_waveforms_of_either_order_and_width() {
    for (big_endian, words) in [(false, false), (false, true), (true, false), (true, true)] {
        let contents = lecroy(&Trace { big_endian, words, ..Trace::default() });
        let c = channel(&contents, "/C3");
        assert_eq!(values(c), [-2.0, -1.5, -2.5, 48.0, -52.0, 1.5], "{big_endian} {words}");
        assert_eq!((c.unit.as_str(), c.sample_rate_hz, c.long_name.as_str()), ("V", Some(1e6), "LECROYTEST"));
        assert_eq!(contents.started_at, "2020-12-01T02:03:04.5");
        assert!(contents.remarks.is_empty(), "{:?}", contents.remarks);
    }
}

#[test]
fn lecroy_sequences_have_gaps_and_spectra_no_rate() {
    let sequence = lecroy(&Trace { segments: 3, ..Trace::default() });
    let c = channel(&sequence, "/C3");
    assert_eq!((values(c)[0], c.gaps.as_slice()), (-2.0, &[2, 4][..]));
    assert!(remarked(&sequence, "a sequence of 3 segments"));
    let odd = lecroy(&Trace { segments: 4, ..Trace::default() });
    assert!(odd.channels[0].gaps.is_empty() && remarked(&odd, "do not divide the samples"));
    let spectrum = lecroy(&Trace { horizontal_unit: "Hz", ..Trace::default() });
    assert!(spectrum.channels[0].sample_rate_hz.is_none() && remarked(&spectrum, "steps of 0.0000009"));
}

#[test]
fn lecroy_files_that_hold_no_signal_are_refused() {
    let error = |trace: &Trace| open::<LeCroy>("refused.trc", &trace.file()).unwrap_err();
    let cases = [
        (Trace { record_type: 5, ..Trace::default() }, "complex numbers"),
        (Trace { record_type: 2, ..Trace::default() }, "a histogram"),
        (Trace { template: "LECROY_1_0", ..Trace::default() }, "not read: this waveform has the template «LECROY_1_0»"),
        (Trace { codes: Vec::new(), ..Trace::default() }, "found no samples"),
    ];
    for (trace, words) in cases {
        let error = error(&trace);
        assert!(error.problem.contains(words) && error.at_byte.is_some() && error.help.is_some(), "{words}: {error:?}");
    }
    // headers that contradict themselves: byte order, more samples than the array holds, words counted as bytes
    let changed = |trace: Trace, at: usize, word: &[u8]| {
        let mut bytes = trace.file();
        bytes[11 + at..11 + at + word.len()].copy_from_slice(word);
        open::<LeCroy>("contradicts.trc", &bytes).unwrap_err()
    };
    let older = changed(Trace::default(), 16, b"LECROY_1_0");
    assert!(!older.help.unwrap().contains("damaged"));
    let order = changed(Trace::default(), 34, &[2, 0]);
    assert!(order.problem.contains("found the byte order 512"), "{order:?}");
    let more = changed(Trace::default(), 116, &[7, 0]);
    assert!(more.problem.contains("found 7 samples of 2 bytes in an array of 12 bytes"), "{more:?}");
    let words = changed(Trace { words: false, ..Trace::default() }, 116, &[3, 0]);
    assert!(words.problem.contains("found 3 samples of 1 bytes in an array of 6 bytes"), "{words:?}");
    let whole = Trace::default().file();
    let cut = open::<LeCroy>("cut.trc", &whole[..whole.len() - 1]).unwrap_err();
    assert!(cut.problem.contains("wanted 12 bytes from byte 363"), "{cut:?}");
}

#[test]
fn keysight_and_rigol_waveforms_with_sizes_of_both_widths() {
    for (mark, wide, format) in [
        (b"AG10", false, "Keysight or Agilent binary waveform, version 10"),
        (b"RG01", false, "Rigol binary waveform, version 01"),
        (b"RG03", true, "Rigol binary waveform, version 03"),
    ] {
        let bytes = bin_file(
            mark,
            wide,
            &[
                ("CH1", 1, 0, vec![(1, vec![1.0, -2.5, 3.0])]),
                ("", 1, 0, vec![(1, vec![4.0])]),
                ("D0", 6, 0, vec![(6, vec![1.0, 0.0])]),
            ],
        );
        assert!(Keysight::recognises(&bytes, Path::new("x")));
        let contents = open::<Keysight>("built.bin", &bytes).unwrap();
        assert_eq!((contents.format.as_str(), contents.started_at.as_str()), (format, "2020-11-22T19:02:34"));
        assert_eq!(locations(&contents), ["/CH1", "/waveform", "/D0"]);
        let c = channel(&contents, "/CH1");
        assert_eq!(values(c), [1.0, -2.5, 3.0]);
        assert_eq!((c.unit.as_str(), c.sample_rate_hz), ("V", Some(500_000.0)));
        assert_eq!((values(channel(&contents, "/D0")), channel(&contents, "/D0").stored_as), (vec![1.0, 0.0], "uint8"));
    }
}

#[test]
fn segments_are_gaps_and_peaks_are_two_channels() {
    let segment = |number: u32, values: &[f32]| ("1", 1, number, vec![(1, values.to_vec())]);
    let waves = [segment(1, &[1.0, 2.0]), segment(2, &[3.0, 4.0, 5.0]), segment(3, &[6.0])];
    let segments = open::<Keysight>("segments.bin", &bin_file(b"AG10", false, &waves)).unwrap();
    let c = channel(&segments, "/1");
    assert_eq!((values(c), c.gaps.as_slice()), (vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[2, 5][..]));
    let peaks = [("1", 2, 0, vec![(2, vec![2.0, 3.0]), (3, vec![-2.0, -3.0])]), ("1", 5, 0, vec![(5, vec![9.0])])];
    let peaks = open::<Keysight>("peaks.bin", &bin_file(b"AG10", false, &peaks)).unwrap();
    assert_eq!(locations(&peaks), ["/1/maximum", "/1/minimum"]);
    assert_eq!(values(channel(&peaks, "/1/minimum")), [-2.0, -3.0]);
    assert!(remarked(&peaks, "it holds counts"), "{:?}", peaks.remarks);
}

#[test]
fn damaged_keysight_files_are_refused() {
    let whole = bin_file(b"AG10", false, &[("1", 1, 0, vec![(1, vec![1.0, 2.0])])]);
    let error = |bytes: &[u8]| -> FormatError { open::<Keysight>("damaged.bin", bytes).unwrap_err() };
    let changed = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    let cases = [
        (whole[..whole.len() - 1].to_vec(), "samples: wanted 8 bytes from byte 164"),
        (whole[..100].to_vec(), "the header of a waveform: wanted 140 bytes"),
        (changed(11, 0xFF), "waveforms, wanted at most"),
        (changed(20, 0xFF), "found 255 buffers"),
        (changed(152, 1), "a buffer's header of 1 bytes"),
        (changed(12, 1), "found no header of a binary waveform"),
    ];
    for (bytes, words) in cases {
        let error = error(&bytes);
        assert!(error.problem.contains(words) && error.at_byte.is_some() && error.help.is_some(), "{words}: {error:?}");
    }
    // two points stated and eight bytes there; three points and eight bytes contradict each other
    assert_eq!(open::<Keysight>("points.bin", &changed(24, 2)).unwrap().channels.len(), 1);
    let contents = open::<Keysight>("points.bin", &changed(24, 3)).unwrap();
    assert!(contents.channels.is_empty() && remarked(&contents, "it has 8 bytes, wanted 12 for the 3 points stated"));
}

const LONG: &str = ":WFMPRE:BYT_NR 2;BIT_NR 16;ENCDG BIN;BN_FMT RI;BYT_OR MSB;NR_PT 3;\
    WFID \"Ch2, DC coupling; a note, 10 points\";PT_FMT Y;XINCR 1.0E-5;PT_OFF 0;XZERO 3.5E-4;XUNIT \"s\";\
    YMULT 0.5;YZERO 1.0;YOFF 2.0;YUNIT \"V\"";

#[test]
fn tektronix_waveforms_in_all_codings() {
    let word = |big: bool, code: i16| if big { code.to_be_bytes() } else { code.to_le_bytes() };
    let words = |big: bool| [4_i16, -2, 0].map(|code| word(big, code)).concat();
    let floats = [4_f32, -2.0, 0.0].map(f32::to_le_bytes).concat();
    let little = LONG.replace("BYT_OR MSB", "BYT_OR LSB");
    let float = little.replace("BYT_NR 2;BIT_NR 16", "BYT_NR 4;BIT_NR 32").replace("BN_FMT RI", "BN_FMT FP");
    let short = ":WFMP:NR_P 3;:WFMP:BYT_N 1;BIT_N 8;ENC BIN;BN_F RI;BYT_O MSB;WFI \"Ch2, DC\";PT_F Y;XUN \"s\";\
        XIN 10.0E-6;XZE 0;PT_O 0;YUN \"V\";YMU 500.0E-3;YOF 2;YZE 1.0E+0";
    let curve = |bytes: &[u8]| [format!("#1{}", bytes.len()).into_bytes(), bytes.to_vec()].concat();
    let cases = [
        ("words", isf_file(LONG, &curve(&words(true)))),
        ("little", isf_file(&little, &curve(&words(false)))),
        ("floats", isf_file(&float, &[b"#212".to_vec(), floats].concat())),
        ("short", isf_file(short, &curve(&[4, 0xFE, 0]))),
        ("text", isf_file(&LONG.replace("ENCDG BIN", "ENCDG ASC"), b"4,-2,0\n")),
        ("endless", isf_file(LONG, &[b"#0".to_vec(), words(true)].concat())),
    ];
    for (name, bytes) in cases {
        assert!(TektronixIsf::recognises(&bytes, Path::new("x")), "{name}");
        let contents = open::<TektronixIsf>("built.isf", &bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        let c = channel(&contents, "/Ch2");
        assert_eq!(values(c), [2.0, -1.0, 0.0], "{name}");
        assert_eq!((c.unit.as_str(), c.sample_rate_hz), ("V", Some(1e5)), "{name}");
    }
}

#[test]
fn tektronix_envelopes_cuts_and_refusals() {
    let envelope = LONG.replace("PT_FMT Y", "PT_FMT ENV").replace("NR_PT 3", "NR_PT 4");
    let bytes = [-2_i16, 2, -4, 4].map(i16::to_be_bytes).concat();
    let contents =
        open::<TektronixIsf>("envelope.isf", &isf_file(&envelope, &[b"#18".to_vec(), bytes].concat())).unwrap();
    assert_eq!(locations(&contents), ["/Ch2/minimum", "/Ch2/maximum"]);
    assert_eq!(values(channel(&contents, "/Ch2/maximum")), [1.0, 2.0]);
    assert_eq!(contents.channels[0].sample_rate_hz, Some(5e4));
    let cut = open::<TektronixIsf>("cut.isf", &isf_file(LONG, b"#16\x00\x04\xFF")).unwrap();
    assert!(values(&cut.channels[0]) == [2.0] && remarked(&cut, "there are 3") && remarked(&cut, "says 3 points"));
    let cases = [
        (isf_file(&LONG.replace("BN_FMT RI", "BN_FMT XX"), b"#11\x00"), "found codes of kind «XX»"),
        (isf_file(&LONG.replace("YMULT 0.5", "YMULT x"), b"#12\x00\x01"), "found YMU «x»"),
        (isf_file(&LONG.replace("YMULT 0.5", "YMULT 0"), b"#12\x00\x01"), "found YMULT 0"),
        (isf_file(LONG, b"12"), "wanted a block of bytes"),
        (isf_file(&LONG.replace("BIT_NR 16", "BIT_NR 8"), b"#12\x00\x01"), "found BIT_NR 8 and BYT_NR 2"),
        (isf_file(&LONG.replace("BYT_OR MSB", "BYT_OR XSB"), b"#12\x00\x01"), "found the byte order «XSB»"),
        (isf_file(LONG, b"#13\x00\x01\x02"), "found BYT_NR 2 and 3 points in a block of 3 bytes"),
        (isf_file(LONG, b"#10"), "found no samples"),
        (LONG.as_bytes().to_vec(), "found no «CURVE»"),
        (isf_file(&LONG.replace("ENCDG BIN", "ENCDG ASC"), b"4,x"), "found «x» as code 2"),
    ];
    for (bytes, words) in cases {
        let error = open::<TektronixIsf>("refused.isf", &bytes).unwrap_err();
        assert!(error.problem.contains(words) && error.help.is_some(), "{words}: {error:?}");
    }
}
