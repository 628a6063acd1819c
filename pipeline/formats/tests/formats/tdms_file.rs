//! Builds TDMS files byte by byte.

#![allow(dead_code)] // each test binary uses a part

/// Flags of a lead-in.
pub const META: u32 = 1 << 1;
pub const NEW_LIST: u32 = 1 << 2;
pub const RAW: u32 = 1 << 3;
pub const INTERLEAVED: u32 = 1 << 5;
pub const DAQMX: u32 = 1 << 7;

/// Bytes in one byte order.
#[derive(Debug, Clone, Default)]
pub struct Bytes {
    pub big: bool,
    pub bytes: Vec<u8>,
}

/// What is said of an object.
pub struct Object {
    pub path: &'static str,
    pub index: Index,
    pub properties: Vec<(&'static str, Property)>,
}

pub enum Index {
    None,
    Same,
    Plain {
        code: u32,
        values: u64,
    },
    Text {
        values: u64,
        size: u64,
    },
    /// Type, byte offset, buffer, scale id; widths.
    Daqmx {
        values: u64,
        scalers: Vec<(u32, u32, u32, u32)>,
        widths: Vec<u32>,
    },
    /// Type, bit offset; width.
    Digital {
        values: u64,
        code: u32,
        bit: u32,
        width: u32,
    },
}

#[derive(Clone)]
pub enum Property {
    F64(f64),
    U32(u32),
    Text(&'static str),
    Time(i64, u64),
}

impl Bytes {
    pub fn new(big: bool) -> Self {
        Self { big, bytes: Vec::new() }
    }

    /// Least significant byte first, turned if need be.
    pub fn put<const N: usize>(&mut self, mut number: [u8; N]) {
        if self.big {
            number.reverse();
        }
        self.bytes.extend(number);
    }

    pub fn u32(&mut self, number: u32) {
        self.put(number.to_le_bytes());
    }

    pub fn u64(&mut self, number: u64) {
        self.put(number.to_le_bytes());
    }

    pub fn text(&mut self, text: &str) {
        self.u32(text.len() as u32);
        self.bytes.extend(text.bytes());
    }

    fn object(&mut self, object: &Object) {
        self.text(object.path);
        match &object.index {
            Index::None => self.u32(u32::MAX),
            Index::Same => self.u32(0),
            Index::Plain { code, values } => {
                self.u32(20);
                self.u32(*code);
                self.u32(1);
                self.u64(*values);
            }
            Index::Text { values, size } => {
                self.u32(28);
                self.u32(0x20);
                self.u32(1);
                self.u64(*values);
                self.u64(*size);
            }
            Index::Daqmx { values, scalers, widths } => {
                self.u32(0x1269);
                self.u32(u32::MAX);
                self.u32(1);
                self.u64(*values);
                self.u32(scalers.len() as u32);
                for (code, offset, buffer, id) in scalers {
                    [*code, *buffer, *offset, 0, *id].into_iter().for_each(|n| self.u32(n));
                }
                self.u32(widths.len() as u32);
                widths.iter().for_each(|w| self.u32(*w));
            }
            Index::Digital { values, code, bit, width } => {
                self.u32(0x126A);
                self.u32(u32::MAX);
                self.u32(1);
                self.u64(*values);
                self.u32(1);
                [*code, 0, *bit].into_iter().for_each(|n| self.u32(n));
                self.bytes.push(0);
                [0, 1, *width].into_iter().for_each(|n| self.u32(n));
            }
        }
        self.u32(object.properties.len() as u32);
        for (name, value) in &object.properties {
            self.text(name);
            match value {
                Property::F64(v) => {
                    self.u32(10);
                    self.put(v.to_le_bytes());
                }
                Property::U32(v) => {
                    self.u32(7);
                    self.u32(*v);
                }
                Property::Text(v) => {
                    self.u32(0x20);
                    self.text(v);
                }
                Property::Time(seconds, fraction) => {
                    self.u32(0x44);
                    let mut both = [0; 16];
                    both[..8].copy_from_slice(&fraction.to_le_bytes());
                    both[8..].copy_from_slice(&seconds.to_le_bytes());
                    self.put(both);
                }
            }
        }
    }
}

/// A segment: flags (without the byte order's), objects (none: no metadata), raw data.
pub fn segment(big: bool, flags: u32, objects: &[Object], raw: &[u8]) -> Vec<u8> {
    let mut metadata = Bytes::new(big);
    if flags & META != 0 {
        metadata.u32(objects.len() as u32);
        objects.iter().for_each(|o| metadata.object(o));
    }
    let metadata = metadata.bytes;
    let mut segment = b"TDSm".to_vec();
    segment.extend((flags | if big { 1 << 6 } else { 0 }).to_le_bytes());
    let mut lead = Bytes::new(big);
    lead.u32(4713);
    lead.u64((metadata.len() + raw.len()) as u64);
    lead.u64(metadata.len() as u64);
    segment.extend(lead.bytes);
    segment.extend(metadata);
    segment.extend(raw);
    segment
}

/// A channel without properties.
pub fn plain(path: &'static str, code: u32, values: u64) -> Object {
    Object { path, index: Index::Plain { code, values }, properties: Vec::new() }
}

pub fn object(path: &'static str, index: Index, properties: Vec<(&'static str, Property)>) -> Object {
    Object { path, index, properties }
}

/// 16-bit numbers.
pub fn i16s(big: bool, numbers: &[i16]) -> Vec<u8> {
    let mut bytes = Bytes::new(big);
    numbers.iter().for_each(|n| bytes.put(n.to_le_bytes()));
    bytes.bytes
}

/// Double precision.
pub fn f64s(big: bool, numbers: &[f64]) -> Vec<u8> {
    let mut bytes = Bytes::new(big);
    numbers.iter().for_each(|n| bytes.put(n.to_le_bytes()));
    bytes.bytes
}
