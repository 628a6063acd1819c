//! NPY files and archives put together byte by byte.

use crate::support::{Temporary, locations, remarked, samples, written};
use afmid_formats::readers::numpy::{Npy, Npz};
use afmid_formats::{Contents, Format, FormatError};

fn npy(version: u8, dictionary: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    if version == 1 {
        bytes.extend((dictionary.len() as u16).to_le_bytes());
    } else {
        bytes.extend((dictionary.len() as u32).to_le_bytes());
    }
    bytes.extend(dictionary.as_bytes());
    bytes.extend(data);
    bytes
}

fn open(bytes: &[u8]) -> Result<Contents, FormatError> {
    Npy::open(&Temporary::new("npy", bytes).0)
}

const FOUR: &str = "{'descr': '<i2', 'fortran_order': False, 'shape': (4,), }";

#[test]
fn a_file_without_filling_is_read() {
    let file = Temporary::new("npy", &npy(2, FOUR, &[1, 0, 2, 0, 3, 0, 4, 0, 9]));
    let contents = Npy::open(&file.0).unwrap();
    assert_eq!(samples(&contents.channels[0]), [1.0, 2.0, 3.0, 4.0]);
    assert!(remarked(&contents, "1 bytes behind the array"));
}

#[test]
fn headers_that_lie_are_refused() {
    let with = |from: &str, to: &str| npy(1, &FOUR.replace(from, to), &[0; 8]);
    let cases: [(&str, Vec<u8>); 12] = [
        ("no magic", b"\x93NUMPX\x01\x00".to_vec()),
        ("version 4.0", npy(4, FOUR, &[])),
        ("in the middle", b"\x93NUMPY\x01\x00".to_vec()),
        ("a header of", npy(1, FOUR, &[])[..40].to_vec()),
        ("a header of", npy(2, FOUR, &[])[..40].to_vec()),
        ("4 of them are missing", npy(1, FOUR, &[0; 4])),
        ("no Python dictionary", with("(4,)", "(-4,)")),
        ("has no 'descr'", with("descr", "description")),
        ("neither True nor", with("False", "0")),
        ("no tuple", with("(4,)", "4")),
        ("cannot exist", with("(4,)", "(4, 9223372036854775807)")),
        ("is no type", with("<i2", "<q2")),
    ];
    for (problem, bytes) in cases {
        let error = open(&bytes).unwrap_err();
        assert!(
            error.problem.contains(problem) && error.at_byte.is_some() && error.help.is_some(),
            "{problem}: {error:?}"
        );
    }
}

#[test]
fn too_many_channels_are_left_out() {
    let wide = FOUR.replace("(4,)", "(17, 100000)").replace("<i2", "|u1");
    let contents = open(&npy(1, &wide, &[0; 1_700_000])).unwrap();
    assert!(contents.channels.is_empty() && remarked(&contents, "too many to list"), "{:?}", contents.remarks);
}

#[test]
fn distant_samples_are_read_one_by_one() {
    // 600 rows of 20 fields of 1000 bytes: the samples of the first field lie 20 kB apart.
    let fields: Vec<String> = (0..20).map(|n| format!("('f{n}', '|u1'), ('', '|V999')")).collect();
    let fields = FOUR.replace("'<i2'", &format!("[{}]", fields.join(", "))).replace("(4,)", "(600,)");
    let data: Vec<u8> = (0..600 * 20_000).map(|at| if at % 1000 == 0 { (at / 20_000) as u8 } else { 255 }).collect();
    let file = Temporary::new("npy", &npy(1, &fields, &data));
    let contents = Npy::open(&file.0).unwrap();
    assert_eq!(contents.channels.len(), 20);
    let wanted: Vec<f64> = (0..600).map(|row| f64::from(row as u8)).collect();
    assert_eq!(samples(&contents.channels[19]), wanted);
}

#[test]
fn archives_are_checked() {
    let bytes = std::fs::read(written("deflated.npz")).unwrap();
    let npz = |bytes: &[u8]| Npz::open(&Temporary::new("npz", bytes).0);
    assert!(npz(&bytes[..bytes.len() - 30]).unwrap_err().problem.contains("the archive cannot be read"));
    // The directory's checksum of the first member: 16 bytes behind the beginning of its entry.
    let entry = bytes.windows(4).position(|bytes| bytes == b"PK\x01\x02").unwrap();
    let mut other = bytes.clone();
    other[entry + 16] ^= 1;
    let error = npz(&other).unwrap_err();
    assert!(error.problem.contains("checksum") && error.at_byte.is_some(), "{error:?}");
    // A method nobody uses in an NPZ: 12, bzip2.
    let mut other = bytes.clone();
    other[entry + 10] = 12;
    let contents = npz(&other).unwrap();
    assert!(
        remarked(&contents, "/deflection is compressed by") && locations(&contents).len() == 2,
        "{:?}",
        contents.remarks
    );
    // Encrypted: bit 0 of the flags.
    let mut other = bytes;
    other[entry + 8] |= 1;
    assert!(remarked(&npz(&other).unwrap(), "/deflection is encrypted"));
}

#[test]
fn other_zip_archives_are_not_taken_for_npz() {
    let bytes = std::fs::read(written("stored.npz")).unwrap();
    assert!(Npz::recognises(&bytes, std::path::Path::new("no.ending")));
    let other: Vec<u8> = bytes.iter().map(|&byte| if byte == b'y' { b'z' } else { byte }).collect();
    assert!(!Npz::recognises(&other, std::path::Path::new("some.docx")));
}
