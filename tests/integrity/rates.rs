//! A sample rate is a number that can be one, wherever it comes from; what a file states instead is said.

use std::fs;
use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};

use super::common::{afmid, command};

/// What the program says where it must fail.
fn fails(here: &Path, arguments: &[&str]) -> String {
    let output = command(here, arguments).output().expect("afmid starts");
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert!(matches!(output.status.code(), Some(1 | 2)), "afmid {arguments:?}: {}\n{said}", output.status);
    said
}

/// A config that reads a file, with further parameters of `io.records`.
fn config(file: &str, more: &str) -> String {
    format!(
        "[pipeline]\nname = \"a\"\n\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
         params = {{ files = [\"{file}\"], channel = \"x\", unit = \"V\"{more} }}\n\n\
         [[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = {{ records = \"records\" }}\n"
    )
}

fn native(path: &Path, sample_rate_hz: f64) {
    let channel = NativeChannel {
        location: "x".to_owned(),
        codes: Codes::Int16((0..3000i16).map(|k| k.wrapping_mul(7919) % 1000).collect()),
        unit: "V".to_owned(),
        scale_factor: 1e-3,
        add_offset: 0.0,
        long_name: String::new(),
    };
    let record = NativeRecord { sample_rate_hz, started_at: String::new(), channels: vec![channel] };
    write_native(path, &record, RecordStorage::Raw).expect("a record");
}

/// A NumPy archive of `x` and the number `fs`, stored.
fn npz(path: &Path, fs: f64) {
    let header = |shape: &str| {
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        [b"\x93NUMPY\x01\0".as_slice(), &118_u16.to_le_bytes(), format!("{text:<117}\n").as_bytes()].concat()
    };
    let x: Vec<u8> = (0..3000).flat_map(|k| (f64::from(k * 7919 % 1000) / 1e3).to_le_bytes()).collect();
    let members =
        [("x.npy", [header("(3000,)"), x].concat()), ("fs.npy", [header("()"), fs.to_le_bytes().to_vec()].concat())];
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in &members {
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        let about: Vec<u8> =
            [crc.sum(), bytes.len() as u32, bytes.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
        let about = [about, (name.len() as u16).to_le_bytes().to_vec(), vec![0; 2]].concat();
        let at = (file.len() as u32).to_le_bytes();
        file.extend([&b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0"[..], &about, name.as_bytes(), bytes].concat());
        directory
            .extend([&b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0"[..], &about, &[0; 10], &at, name.as_bytes()].concat());
    }
    let ends = [members.len() as u16; 2].iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let sizes = [directory.len() as u32, file.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    fs::write(path, [&file[..], &directory, b"PK\x05\x06\0\0\0\0", &ends, &sizes, &[0; 2]].concat()).expect("written");
}

fn csv(path: &Path, rate: &str) {
    let rows: String = (0..3000).map(|k| format!("{}\n", f64::from(k * 7919 % 1000) / 1e3)).collect();
    fs::write(path, format!("Sample rate: {rate}\nx\n{rows}")).expect("written");
}

#[test]
fn what_a_file_states_instead_of_a_rate_is_said() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    for (rate, shown) in [(0.0, "0"), (-1.0, "-1"), (f64::NAN, "NaN"), (f64::INFINITY, "inf"), (1e300, "1e300")] {
        native(&here.join("a.h5"), rate);
        npz(&here.join("a.npz"), rate);
        for (file, wanted) in [("a.h5", format!("sample_rate_hz is {shown},")), ("a.npz", format!("fs = {shown},"))] {
            fs::write(here.join("c.toml"), config(file, "")).expect("a config");
            let said = fails(here, &["run", "c.toml", "-o", "out.h5", "--cache", "cache"]);
            assert!(said.contains(&wanted) && said.contains("1e-9 to 1e15"), "{file}, {rate}: {said}");
            assert!(!said.contains("states no sample rate"), "{file}, {rate}: {said}");
            let said = afmid(here, &["inspect", file]);
            assert!(said.contains(&format!("= {shown},")) && !said.contains("states no sample rate"), "{said}");
        }
    }
    for rate in ["0", "-1", "0 Hz"] {
        csv(&here.join("a.csv"), rate);
        fs::write(here.join("c.toml"), config("a.csv", "")).expect("a config");
        let said = fails(here, &["run", "c.toml", "-o", "out.h5", "--cache", "cache"]);
        assert!(said.contains(&format!("Sample rate {rate}")), "{rate}: {said}");
    }
    // with one that is given, what the file states does not matter
    fs::write(here.join("c.toml"), config("a.npz", ", sample_rate_hz = 1e6")).expect("a config");
    afmid(here, &["run", "c.toml", "-o", "out.h5", "--cache", "cache"]);
    // and one that states nothing says so
    fs::write(here.join("b.csv"), "x\n1.5\n2.5\n3.5\n1.25\n").expect("a table");
    fs::write(here.join("c.toml"), config("b.csv", "")).expect("a config");
    let said = fails(here, &["run", "c.toml", "-o", "out.h5", "--cache", "cache"]);
    assert!(said.contains("states no sample rate"), "{said}");
}

#[test]
fn a_rate_beyond_all_sampling_is_refused_wherever_it_is_given() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    csv(&here.join("a.csv"), "1e300");
    let said = fails(here, &["new", "pipeline", "a.csv", "--goal", "decay", "--rate", "1e300", "--unit", "V"]);
    assert!(said.contains("1e300") && said.contains("1e-9 to 1e15"), "{said}");
    for rate in ["1e300", "1e-300", "inf", "nan"] {
        let records = config("a.csv", &format!(", sample_rate_hz = {rate}"));
        let columns = format!(
            "[pipeline]\nname = \"a\"\n\n[[stage]]\nid = \"data\"\nuses = \"io.columns\"\n\
             params = {{ file = \"a.csv\", inputs = [1], output = 1, sample_rate_hz = {rate} }}\n"
        );
        let simulated = format!(
            "[pipeline]\nname = \"a\"\nseed = 1\n\n[[stage]]\nid = \"archive\"\nuses = \"simulate.afm\"\n\
             params = {{ out = \"sim\", sample_rate_hz = {rate} }}\n"
        );
        for text in [records, columns, simulated] {
            fs::write(here.join("c.toml"), &text).expect("a config");
            let said = fails(here, &["check", "c.toml"]);
            assert!(said.contains("sample_rate_hz"), "{text}: {said}");
        }
    }
    // times whose step is no interval of a recording
    let rows: String = (0..100).map(|k| format!("{}e-301,{}\n", k, k % 7)).collect();
    fs::write(here.join("t.csv"), format!("time (s),x\n{rows}")).expect("a table");
    fs::write(here.join("c.toml"), config("t.csv", "")).expect("a config");
    let said = fails(here, &["run", "c.toml", "-o", "out.h5", "--cache", "cache"]);
    assert!(said.contains("wanted 1e-9 to 1e15"), "{said}");
}
