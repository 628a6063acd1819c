//! SHA-256 of files, as repositories and their tools check it.

use std::io::Read;
use std::path::Path;

use afmid_pipeline::files::open_regular;
use sha2::{Digest, Sha256};

/// SHA-256 of a file's bytes.
pub struct Sha(Vec<u8>);

impl Sha {
    /// Streams a file. Errors: it cannot be read.
    pub fn of_file(path: &Path) -> std::io::Result<Self> {
        let mut file = open_regular(path)?;
        let (mut hasher, mut buffer) = (Sha256::new(), vec![0; 1 << 18]);
        loop {
            match file.read(&mut buffer)? {
                0 => return Ok(Self(hasher.finalize().to_vec())),
                count => hasher.update(&buffer[..count]),
            }
        }
    }

    /// SHA-256 of a text.
    pub fn of_text(text: &str) -> Self {
        Self(Sha256::digest(text.as_bytes()).to_vec())
    }

    /// In hexadecimal.
    pub fn hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// As a name that depends on the bytes alone: RFC 6920, `ni:///sha-256;...` in base64url without padding.
    pub fn name(&self) -> String {
        const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
        let mut text = String::from("ni:///sha-256;");
        for chunk in self.0.chunks(3) {
            let bits =
                chunk.iter().enumerate().fold(0u32, |bits, (index, &byte)| bits | u32::from(byte) << (16 - 8 * index));
            for digit in 0..=chunk.len() {
                let index = (bits >> (18 - 6 * digit)) & 63;
                text.push(char::from(DIGITS[index as usize]));
            }
        }
        text
    }
}

#[cfg(test)]
#[test]
fn the_names_are_those_of_rfc_6920() {
    // the RFC's own example, section 8.1
    let sha = Sha::of_text("Hello World!");
    assert_eq!(sha.name(), "ni:///sha-256;f4OxZX_x_FO5LcGBSKHWXfwtSx-j1ncoSt3SABJtkGk");
    assert_eq!(sha.hex(), "7f83b1657ff1fc53b92dc18148a1d65dfc2d4b1fa3d677284addd200126d9069");
}
