//! Files made to do harm: bounded time and memory for every command.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use flate2::write::{DeflateEncoder, ZlibEncoder};
use flate2::{Compression, Crc};

use super::common::{ROOT, afmid, command};

/// What every command keeps to on such files.
const MOST_TIME: Duration = Duration::from_secs(5);
const MOST_BYTES: u64 = 512 << 20;

/// Runs the program and looks at the most memory that it has had, again and again: it is stopped where it passes a
/// limit.
fn bounded(folder: &Path, arguments: &[&str]) {
    let mut command = command(folder, arguments);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts");
    let (clock, of_child) = (Instant::now(), format!("/proc/{}", child.id()));
    // until it is the program, the child has the test's own memory
    let begun = || fs::read_link(format!("{of_child}/exe")).is_ok_and(|program| program.ends_with("afmid"));
    let mut most = 0;
    let ended = loop {
        let text =
            if begun() { fs::read_to_string(format!("{of_child}/status")).unwrap_or_default() } else { String::new() };
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
        most = most.max(kib.unwrap_or(0) << 10);
        if let Some(status) = child.try_wait().expect("the child is there") {
            break status;
        }
        if clock.elapsed() > MOST_TIME || most > MOST_BYTES {
            child.kill().expect("it can be stopped");
            child.wait().expect("it ends");
            panic!("afmid {arguments:?}: {} MB after {:?}", most >> 20, clock.elapsed());
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(ended.code().is_some_and(|code| code != 101), "afmid {arguments:?}: {ended}");
}

/// Every command that takes a file, on a file.
pub fn every_command(folder: &Path, file: &Path) {
    let shown = file.display().to_string();
    let text = |name: &str, text: String| fs::write(folder.join(name), text).expect("a config is written");
    let config = |stage: &str| format!("[pipeline]\nname = \"a\"\nseed = 1\n\n[[stage]]\nid = \"records\"\n{stage}\n");
    for (name, params) in [
        (
            "records.toml",
            format!(
                "uses = \"io.records\"\nparams = {{ files = [{shown:?}], channel = \"/x\", sample_rate_hz = 1e6, unit = \"V\" }}"
            ),
        ),
        (
            "columns.toml",
            format!(
                "uses = \"io.columns\"\nparams = {{ file = {shown:?}, inputs = [1], output = 1, sample_rate_hz = 1.0 }}"
            ),
        ),
    ] {
        text(name, config(&params));
    }
    text(
        "census.toml",
        fs::read_to_string(folder.join("records.toml")).expect("just written")
            + "\n[[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = { records = \"records.records\" }\n",
    );
    text("sets.jsonl", format!("{{\"name\": \"a\", \"files\": [{shown:?}]}}\n"));
    let cache = ["--cache", "cache"];
    let commands: &[&[&str]] = &[
        &["show", &shown],
        &["show", &shown, "data", "--json"],
        &["report", &shown, "-o", "page.html"],
        &["diff", &shown, &shown],
        &["trace", &shown, "data"],
        &["rerun", &shown],
        &["export", &shown, "data", "-o", "model.json"],
        &["export-crate", &shown, "-o", "crate"],
        &["inspect", &shown],
        &["check", &shown],
        &["graph", &shown],
        &["new", "pipeline", &shown, "--goal", "decay", "-o", "new.toml"],
        &["explain", "records.toml"],
        &["run", "records.toml", "-o", "records.h5"],
        &["run", "census.toml", "-o", "census.h5"],
        &["run", "columns.toml", "-o", "columns.h5"],
        &["batch", "census.toml", "--manifest", "sets.jsonl", "-o", "batch"],
    ];
    for command in commands {
        let arguments = if matches!(command[0], "run" | "explain" | "batch") {
            [command, &cache[..]].concat()
        } else {
            command.to_vec()
        };
        bounded(folder, &arguments);
    }
}

/// A result that runs quickly, with a long text in it and very many short ones.
fn result(folder: &Path) -> Vec<u8> {
    fs::write(folder.join("data.csv"), "u,y\n1,2\n3,3\n2,1\n4,4\n5,2\n6,1\n8,3\n7,2\n").expect("data are written");
    let long: String =
        (0..30_000).map(|line| format!("# a comment that is as long as thirty thousand lines: {line}\n")).collect();
    let config = format!(
        "[pipeline]\nname = \"a\"\nseed = 1\n\n[[stage]]\nid = \"data\"\nuses = \"io.columns\"\n\
         params = {{ file = \"data.csv\", sample_rate_hz = 1.0 }}\n{long}"
    );
    fs::write(folder.join("a.toml"), config).expect("a config is written");
    let mut arguments = vec!["run", "a.toml", "-o", "a.h5", "--cache", "cache"];
    for _ in 0..3000 {
        arguments.extend(["--set", "data.output_unit='V'"]);
    }
    afmid(folder, &arguments);
    fs::read(folder.join("a.h5")).expect("the result is there")
}

const SEAL: &str = "\nafmid seal, BLAKE3 of all bytes before this line: ";

/// The bytes without their seal.
pub fn unsealed(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.truncate(bytes.len() - SEAL.len() - 65);
    bytes
}

/// Seals bytes that have no seal, as anybody who changes a file can.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let hash = blake3::hash(&bytes);
    bytes.extend(format!("{SEAL}{hash}\n").into_bytes());
    bytes
}

fn places(bytes: &[u8], wanted: &[u8]) -> Vec<usize> {
    (0..bytes.len() - wanted.len()).filter(|&at| bytes[at..].starts_with(wanted)).collect()
}

fn number(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

/// Places of the heap collections, and of the largest object's header in them.
fn collections(bytes: &[u8]) -> (Vec<usize>, usize) {
    let found: Vec<usize> = places(bytes, b"GCOL\x01\0\0\0");
    let (mut largest, mut most) = (0, 0);
    for &start in &found {
        let end = start + number(bytes, start + 8) as usize;
        let mut at = start + 16;
        while at + 16 <= end.min(bytes.len()) {
            let (index, size) = (u16::from_le_bytes([bytes[at], bytes[at + 1]]), number(bytes, at + 8) as usize);
            if index == 0 {
                break;
            }
            if size > most {
                (largest, most) = (at, size);
            }
            at += 16 + size.next_multiple_of(8);
        }
    }
    (found, largest)
}

/// The first bytes of a heap collection: its header, then those of objects with these numbers and sizes.
fn heap(bytes: u64, objects: &[(u16, u64)]) -> Vec<u8> {
    let mut heap = [b"GCOL\x01\0\0\0".as_slice(), &bytes.to_le_bytes()].concat();
    for (number, size) in objects {
        heap.extend([&number.to_le_bytes()[..], &[0; 6], &size.to_le_bytes()].concat());
        // a text of up to 8 bytes
        heap.extend(if *number > 0 { vec![b'x'; 8] } else { Vec::new() });
    }
    heap
}

#[test]
fn results_that_were_sealed_again_are_bounded() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = result(folder.path());
    let (heaps, largest) = collections(&whole);
    let size = number(&whole, largest + 8);
    assert!(size > 1 << 20, "the config is the largest text: {size} bytes");
    let of = |largest: usize| *heaps.iter().filter(|&&heap| heap < largest).max().expect("it lies in a heap");
    // the reference to the config: its length, its heap, its number in it
    let index = u32::from(u16::from_le_bytes([whole[largest], whole[largest + 1]]));
    let reference =
        [(size as u32).to_le_bytes().as_slice(), &(of(largest) as u64).to_le_bytes(), &index.to_le_bytes()].concat();
    assert_eq!(places(&whole, &reference).len(), 1);
    // the longest row of references to texts of one length: the arguments
    let length = "data.output_unit='V'".len() as u32;
    let is_argument = |bytes: &[u8], at: usize| {
        bytes[at..at + 4] == length.to_le_bytes() && heaps.contains(&(number(bytes, at + 4) as usize))
    };
    let first = (0..whole.len() - 48_000)
        .find(|&at| (0..3000).all(|row| is_argument(&whole, at + 16 * row)))
        .expect("three thousand references in a row");
    let file = folder.path().join("hostile.h5");
    let damaged = |damage: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = whole.clone();
        damage(&mut bytes);
        fs::write(&file, sealed(unsealed(bytes))).expect("it is written");
        every_command(folder.path(), &file);
        let output = command(folder.path(), &["show", "hostile.h5", "--json"]).output().expect("afmid starts");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    // every argument is the config
    damaged(&|bytes| {
        (0..3000).for_each(|row| bytes[first + 16 * row..first + 16 * row + 16].copy_from_slice(&reference));
    });
    // within the text of the config, where the library sees letters: the guard refuses the file all the same
    let text = largest + 16;
    let said = damaged(&|bytes| {
        let small = heap(4096, &[(1, 3), (0, 8)]);
        bytes[text..text + small.len()].copy_from_slice(&small);
    });
    assert!(said.contains("is smaller than its header"), "{said}");
    let said = damaged(&|bytes| {
        let end = text + size as usize;
        for at in (text..end - 4096).step_by(64) {
            bytes[at..at + 16].copy_from_slice(&heap((end - at) as u64, &[]));
        }
    });
    assert!(said.contains("lie over one another"), "{said}");
    // what was not damaged is shown
    afmid(folder.path(), &["show", "a.h5"]);
    afmid(folder.path(), &["diff", "a.h5", "a.h5"]);
}

/// A zip archive of deflated members of zeros behind their NumPy headers.
fn npz(path: &Path, members: usize, bytes: usize) {
    let header = |count: usize| {
        let text = format!("{{'descr': '|i1', 'fortran_order': False, 'shape': ({count},), }}");
        [b"\x93NUMPY\x01\0".as_slice(), &(118_u16).to_le_bytes(), format!("{text:<117}\n").as_bytes()].concat()
    };
    let (packed, crc) = {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
        let mut crc = Crc::new();
        let zeros = vec![0; 1 << 20];
        let mut put = |bytes: &[u8]| {
            crc.update(bytes);
            encoder.write_all(bytes).expect("memory takes everything");
        };
        put(&header(bytes));
        (0..bytes).step_by(zeros.len()).for_each(|at| put(&zeros[..zeros.len().min(bytes - at)]));
        (encoder.finish().expect("memory takes everything"), crc.sum())
    };
    let whole = bytes + header(bytes).len();
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for member in 0..members {
        let name = if member == 0 { "x.npy".to_owned() } else { format!("x{member}.npy") };
        let at = file.len() as u32;
        let mut about = Vec::new();
        for field in [crc, packed.len() as u32, whole as u32] {
            about.extend(field.to_le_bytes());
        }
        about.extend((name.len() as u16).to_le_bytes());
        about.extend([0; 2]);
        file.extend([b"PK\x03\x04\x14\0\0\0\x08\0\0\0\0\0".as_slice(), &about, name.as_bytes(), &packed].concat());
        directory.extend([b"PK\x01\x02\x14\0\x14\0\0\0\x08\0\0\0\0\0".as_slice(), &about, &[0; 10]].concat());
        directory.extend([&at.to_le_bytes(), name.as_bytes()].concat());
    }
    let (at, count) = (file.len() as u32, members as u16);
    let end = [
        &count.to_le_bytes(),
        &count.to_le_bytes(),
        (directory.len() as u32).to_le_bytes().as_slice(),
        &at.to_le_bytes(),
    ]
    .concat();
    let archive = [file, directory, b"PK\x05\x06\0\0\0\0".to_vec(), end, vec![0; 2]].concat();
    fs::write(path, archive).expect("it is written");
}

/// A MATLAB 5 file of compressed vectors of zeros.
fn mat(path: &Path, variables: usize, bytes: usize) {
    let mut file = [b"MATLAB 5.0 MAT-file".as_slice(), &[b' '; 105], b"\x00\x01IM"].concat();
    for variable in 0..variables {
        let word = |value: usize| (value as u32).to_le_bytes();
        let name = [b'x', b'a' + variable as u8, 0, 0];
        let name = if variable == 0 { *b"x\0\0\0" } else { name };
        let flags = [word(6), word(8), word(9), word(0)].concat();
        let sizes = [word(5), word(8), word(bytes), word(1)].concat();
        let named = [word(1), word(if variable == 0 { 1 } else { 2 }), name, [0; 4]].concat();
        let parts = [flags, sizes, named, [word(1), word(bytes)].concat()].concat();
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        let zeros = vec![0; 1 << 20];
        let mut put = |bytes: &[u8]| encoder.write_all(bytes).expect("memory takes everything");
        put(&[word(14), word(parts.len() + bytes)].concat());
        put(&parts);
        (0..bytes).step_by(zeros.len()).for_each(|at| put(&zeros[..zeros.len().min(bytes - at)]));
        let packed = encoder.finish().expect("memory takes everything");
        file.extend([&word(15), &word(packed.len()), packed.as_slice()].concat());
    }
    fs::write(path, file).expect("it is written");
}

#[test]
fn archives_that_inflate_to_much_are_bounded() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    npz(&path("small.npz"), 1, 5000);
    mat(&path("small.mat"), 1, 5000);
    for small in ["small.npz", "small.mat"] {
        let output = afmid(folder.path(), &["inspect", small]);
        assert!(output.contains("/x") && output.contains("5000"), "{output}");
    }
    // one large member; members that are each within the bounds
    let mib = 1 << 20;
    npz(&path("large.npz"), 1, 700 * mib);
    npz(&path("many.npz"), 40, 60 * mib);
    mat(&path("large.mat"), 1, 700 * mib);
    mat(&path("many.mat"), 12, 60 * mib);
    for name in ["large.npz", "many.npz", "large.mat", "many.mat"] {
        every_command(folder.path(), &path(name));
    }
}

#[test]
fn the_files_of_the_attack_are_bounded() {
    let data = std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(ROOT).join("../shared/data"), PathBuf::from);
    let files = ["bomb.npz", "bomb.mat"].map(|name| data.join("hostile").join(name));
    if !files.iter().all(|file| file.is_file()) {
        println!("stand-in: 2 hostile files are not here, the other tests make their like");
        return;
    }
    for file in files {
        let folder = tempfile::tempdir().expect("a folder");
        let copy = folder.path().join(file.file_name().expect("a name"));
        fs::copy(&file, &copy).expect("it is copied");
        every_command(folder.path(), &copy);
    }
}
