//! Putting MAT-files together byte by byte.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::Write;

/// Writes numbers in one byte order.
#[derive(Clone, Copy)]
pub struct Order(pub bool);

impl Order {
    pub fn put(self, mut little: Vec<u8>) -> Vec<u8> {
        if self.0 {
            little.reverse();
        }
        little
    }

    pub fn word(self, value: u32) -> Vec<u8> {
        self.put(value.to_le_bytes().to_vec())
    }

    pub fn header(self) -> Vec<u8> {
        let mut bytes = b"MATLAB 5.0 MAT-file, built by a test".to_vec();
        bytes.resize(124, b' ');
        bytes.extend(if self.0 { *b"\x01\x00MI" } else { *b"\x00\x01IM" });
        bytes
    }

    /// An element, in the short form if it fits.
    pub fn element(self, kind: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes;
        if (1..=4).contains(&data.len()) {
            bytes = self.word((data.len() as u32) << 16 | kind);
        } else {
            bytes = self.word(kind);
            bytes.extend(self.word(data.len() as u32));
        }
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    }

    pub fn array(self, flags: u32, shape: &[u32], name: &str, rest: &[u8]) -> Vec<u8> {
        let mut inside = self.element(6, &[self.word(flags), self.word(0)].concat());
        inside.extend(self.element(5, &shape.iter().flat_map(|&size| self.word(size)).collect::<Vec<u8>>()));
        inside.extend(self.element(1, name.as_bytes()));
        inside.extend(rest);
        self.element(14, &inside)
    }
}

pub fn compressed(array: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(array).unwrap();
    let packed = encoder.finish().unwrap();
    let mut bytes = 15_u32.to_le_bytes().to_vec();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

/// One variable of level 4.
pub fn level4(order: Order, code: u32, shape: [u32; 2], imaginary: u32, name: &str, data: &[u8]) -> Vec<u8> {
    let code = code + if order.0 { 1000 } else { 0 };
    let mut bytes: Vec<u8> =
        [code, shape[0], shape[1], imaginary, name.len() as u32 + 1].iter().flat_map(|&w| order.word(w)).collect();
    bytes.extend(name.as_bytes());
    bytes.push(0);
    bytes.extend(data);
    bytes
}
