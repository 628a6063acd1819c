//! Damaged files: cut at some hundred places and with random bytes flipped. Never a panic, never much memory, always an
//! end.

use crate::scope_files::{Trace, bin_file, isf_file};
use crate::support::{self, Random, peak_bytes};
use crate::tdms_file::*;
use afmid_formats::Format;
use afmid_formats::readers::{keysight::Keysight, lecroy::LeCroy, netcdf::NetCdf, tdms::Tdms, tektronix::TektronixIsf};
use afmid_formats::readers::{text_table::TextTable, uff::Uff, wav::Wav};
use std::path::Path;
use std::time::{Duration, Instant};

/// Opens and reads everything; the outcome may be anything that returns.
fn read_all<F: Format>(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).unwrap();
    let began = Instant::now();
    F::recognises(&bytes[..bytes.len().min(4096)], path);
    if let Ok(contents) = F::open(path) {
        for channel in &contents.channels {
            // A sample of any format takes a byte of the file or more.
            assert!(channel.samples <= bytes.len(), "{} samples from {} bytes", channel.samples, bytes.len());
            assert!(channel.gaps.is_sorted() && channel.gaps.last().is_none_or(|&gap| gap < channel.samples));
            let _ = channel.source.read(0, channel.samples);
            let _ = channel.source.read(channel.samples / 2, 1);
        }
    }
    // A file of this size takes milliseconds; a loop that does not end, or one that goes over all pairs of something,
    // would show.
    assert!(began.elapsed() < Duration::from_secs(5), "{} took {:?}", path.display(), began.elapsed());
}

fn torment<F: Format>(name: &str, whole: &[u8], flips: usize) {
    let path = support::file(&format!("hostile-{name}"), whole);
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ whole.len() as u64);
    for cut in 0..300 {
        // Densely where headers are, then over the whole.
        let at = if cut < 100 { cut * 3 } else { random.below(whole.len()) };
        read_all::<F>(&path, &whole[..at.min(whole.len())]);
    }
    for _ in 0..support::few_or_all(flips / 4, flips) {
        let mut copy = whole.to_vec();
        // Half of the damage to the first kilobyte, where it hurts.
        for _ in 0..=random.below(6) {
            let range = if random.below(2) == 0 { whole.len().min(1024) } else { whole.len() };
            let at = random.below(range);
            copy[at] = match random.below(4) {
                0 => 0xFF,
                1 => 0,
                2 => copy[at] ^ (1 << random.below(8)),
                _ => random.below(256) as u8,
            };
        }
        read_all::<F>(&path, &copy);
    }
    let _ = std::fs::remove_file(path);
    // This process's files have 3 MB at most, each with copies and a test's own buffers; one test makes 64 MiB of
    // zeros.
    assert!(peak_bytes() < 400 << 20, "{name}: {} MiB", peak_bytes() >> 20);
}

fn real<F: Format>(name: &str, flips: usize) {
    if let Some(path) = support::real(name) {
        torment::<F>(&name.replace('/', "-"), &std::fs::read(path).unwrap(), flips);
    }
}

#[test]
fn real_tdms_files() {
    for name in ["big_endian", "raw1", "Digital_Input", "raw_timestamps"] {
        real::<Tdms>(&format!("tdms/{name}.tdms"), 1000);
    }
}

#[test]
fn built_tdms_files() {
    for big in [false, true] {
        let flags = META | NEW_LIST | RAW;
        let properties = || vec![("wf_start_time", Property::Time(1000, 7)), ("wf_increment", Property::F64(0.25))];
        let a = |index| object("/'g'/'a'", index, properties());
        let text = object("/'g'/'text'", Index::Text { values: 1, size: 7 }, vec![]);
        let contiguous = [a(Index::Plain { code: 2, values: 2 }), plain("/'g'/'b'", 10, 1), text];
        let raw = [i16s(big, &[1, 2]), f64s(big, &[0.5]), b"\x03\0\0\0abc".to_vec()].concat().repeat(3);
        let daqmx = Index::Daqmx { values: 2, scalers: vec![(3, 0, 0, 0), (1, 0, 1, 1)], widths: vec![4, 2] };
        let digital = Index::Digital { values: 4, code: 0, bit: 3, width: 2 };
        let files = [
            [
                segment(big, flags, &contiguous, &raw),
                segment(big, META | RAW, &[a(Index::Same)], &raw),
                segment(big, RAW, &[], &raw),
                segment(
                    big,
                    flags | INTERLEAVED,
                    &[plain("/'g'/'b'", 10, 2), a(Index::Plain { code: 2, values: 2 })],
                    &[7; 45],
                ),
            ]
            .concat(),
            segment(big, flags | DAQMX, &[object("/'g'/'q'", daqmx, properties())], &[3; 36]),
            segment(big, flags | DAQMX, &[object("/'g'/'q'", digital, properties())], &[3; 16]),
        ];
        for (number, file) in files.iter().enumerate() {
            torment::<Tdms>(&format!("{big}-{number}.tdms"), file, 800);
        }
    }
}

#[test]
fn text_tables() {
    for name in ["multi_time_column", "no_decimal_separator", "short", "with_comments", "with_empty_fields"] {
        real::<TextTable>(&format!("lvm/{name}.lvm"), 600);
    }
    torment::<TextTable>("a.csv", b"# made\nTime (s),a [V],\"b\"\n0.0,1.5,x\n0.1,-2.5,\n0.2,3e-3,4\n0.3,1,1\n", 800);
    torment::<TextTable>("a.dat", "Zeit\tKraft\ns\tµN\n0,0\t1,5\n0,1\t-2,5\n".as_bytes(), 800);
}

#[test]
fn tables_with_headers_of_oscilloscopes() {
    let rows = "0,1,4,,\n1,2,5,,\n2,3,6,,\n";
    let rigol = format!("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-2.0e-03,1.0e-03\n{rows}");
    torment::<TextTable>("rigol.csv", rigol.as_bytes(), 400);
    let beside = "Record Length,3,,0.0000,1\nSample Interval,1E-3,,0.0010,2\nVertical Units,V,,0.0020,3\n,,,0.0030,4\n";
    torment::<TextTable>("tds.csv", beside.as_bytes(), 400);
    let head = "waveform,a\nt0,1/1/2021 10:00:00\ndelta t,1E-3\n\ntime,a\n";
    let blocks = format!("{head}1/1/2021 10:00:00,1\n1/1/2021 10:00:01,2\n{head}1/1/2021 10:00:09,3\n");
    torment::<TextTable>("blocks.csv", blocks.as_bytes(), 400);
}

#[test]
fn waveforms_of_oscilloscopes() {
    for (big_endian, words) in [(false, true), (true, false)] {
        let trace = Trace { big_endian, words, segments: 3, ..Trace::default() };
        torment::<LeCroy>(&format!("{big_endian}.trc"), &trace.file(), 400);
    }
    let waves = [
        ("1", 1, 1, vec![(1, vec![1.0, 2.0])]),
        ("1", 1, 2, vec![(1, vec![3.0])]),
        ("2", 2, 0, vec![(2, vec![1.0]), (3, vec![-1.0])]),
        ("D", 6, 0, vec![(6, vec![1.0, 0.0])]),
    ];
    torment::<Keysight>("ag.bin", &bin_file(b"AG10", false, &waves), 400);
    torment::<Keysight>("rg.bin", &bin_file(b"RG03", true, &waves), 400);
    let preamble = ":WFMPRE:BYT_NR 2;ENCDG BIN;BN_FMT RI;BYT_OR MSB;NR_PT 4;WFID \"Ch1, DC\";PT_FMT ENV;XINCR 1.0E-5;\
        XUNIT \"s\";YMULT 0.5;YZERO 1.0;YOFF 2.0;YUNIT \"V\"";
    torment::<TektronixIsf>("binary.isf", &isf_file(preamble, b"#18\x00\x01\x00\x02\x00\x03\x00\x04"), 400);
    torment::<TektronixIsf>("text.isf", &isf_file(&preamble.replace("BIN", "ASC"), b"4,-2,0,1e3\n"), 400);
}

#[test]
fn wav_files() {
    for name in ["u1", "i2", "f8"] {
        torment::<Wav>(&format!("{name}.wav"), &std::fs::read(support::written(&format!("{name}.wav"))).unwrap(), 400);
    }
}

#[test]
fn netcdf_files() {
    for name in ["records", "fixed", "single", "wide"] {
        let whole = std::fs::read(support::written(&format!("{name}.netcdf"))).unwrap();
        torment::<NetCdf>(&format!("{name}.nc"), &whole, 400);
    }
}

#[test]
fn universal_files() {
    real::<Uff>("uff/Sample_UFF58b_bin.uff", 400);
    real::<Uff>("uff/sample_dataset58_psd.uff", 400);
    if let Some(path) = support::real("uff/sample_dataset58_psd.uff") {
        // The same with real values: there are three numbers a point, of which pairs are read.
        let whole = std::fs::read(path).unwrap();
        let at = whole.windows(20).position(|w| w == b"         5      3201").unwrap();
        let mut copy = whole[..at + 6000].to_vec();
        copy[at..at + 20].copy_from_slice(b"         2        60");
        let end = copy.iter().rposition(|&b| b == b'\n').unwrap();
        copy.truncate(end + 1);
        copy.extend(b"    -1\n");
        torment::<Uff>("real.uff", &copy, 800);
    }
}
