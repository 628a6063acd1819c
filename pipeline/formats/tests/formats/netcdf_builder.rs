//! A builder of classic netCDF files.
#![allow(dead_code, reason = "each test binary uses a part of it")]

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Type {
    Byte,
    Char,
    Short,
    Float,
    Double,
    Other(u32),
}

impl Type {
    fn code(self) -> u32 {
        match self {
            Self::Byte => 1,
            Self::Char => 2,
            Self::Short => 3,
            Self::Float => 5,
            Self::Double => 6,
            Self::Other(code) => code,
        }
    }

    fn bytes(self) -> u64 {
        match self {
            Self::Byte | Self::Char | Self::Other(_) => 1,
            Self::Short => 2,
            Self::Float => 4,
            Self::Double => 8,
        }
    }
}

#[derive(Debug, Clone)]
pub struct Var {
    pub name: &'static str,
    pub dimensions: Vec<u64>,
    pub attributes: Vec<(&'static str, Type, Vec<u8>)>,
    pub kind: Type,
    /// Byte in the data, if it is not behind the variable before.
    pub begin: u64,
    /// Stated otherwise than they are: bytes, and the byte in the file.
    pub bytes: Option<u64>,
    pub absolute: Option<u64>,
}

impl Var {
    pub fn new(name: &'static str, dimensions: &[u64], kind: Type) -> Self {
        let dimensions = dimensions.to_vec();
        Self { name, dimensions, attributes: Vec::new(), kind, begin: 0, bytes: None, absolute: None }
    }
}

#[derive(Debug, Clone)]
pub struct Built {
    pub version: u8,
    pub records: Option<u64>,
    pub dimensions: Vec<(&'static str, u64)>,
    pub variables: Vec<Var>,
    pub data: Vec<u8>,
}

impl Built {
    pub fn of(version: u8) -> Self {
        Self { version, records: Some(0), dimensions: Vec::new(), variables: Vec::new(), data: Vec::new() }
    }

    /// With other dimensions of the only variable.
    pub fn with(self, dimensions: &[u64]) -> Self {
        self.changed(|variable| variable.dimensions = dimensions.to_vec())
    }

    pub fn changed(mut self, change: impl Fn(&mut Var)) -> Self {
        self.variables.iter_mut().for_each(change);
        self
    }

    pub fn bytes(&self) -> Vec<u8> {
        let length = self.header(0).len() as u64;
        [self.header(length), self.data.clone()].concat()
    }

    fn size(&self, size: u64) -> Vec<u8> {
        if self.version == 5 { size.to_be_bytes().to_vec() } else { (size as u32).to_be_bytes().to_vec() }
    }

    fn name(&self, name: &str) -> Vec<u8> {
        [self.size(name.len() as u64), padded(name.as_bytes())].concat()
    }

    fn list(&self, tag: u32, elements: &[Vec<u8>]) -> Vec<u8> {
        let tag = if elements.is_empty() { 0 } else { tag };
        [tag.to_be_bytes().to_vec(), self.size(elements.len() as u64), elements.concat()].concat()
    }

    fn header(&self, data_from: u64) -> Vec<u8> {
        let uncounted = if self.version == 5 { u64::MAX } else { u64::from(u32::MAX) };
        let dimensions: Vec<_> =
            self.dimensions.iter().map(|(name, length)| [self.name(name), self.size(*length)].concat()).collect();
        // variables that begin where nothing else is said follow each other, filled up to four bytes
        let mut begin = data_from;
        let variables: Vec<_> =
            self.variables.iter().map(|variable| self.variable(variable, &mut begin, data_from)).collect();
        [
            [b'C', b'D', b'F', self.version].to_vec(),
            self.size(self.records.unwrap_or(uncounted)),
            self.list(10, &dimensions),
            self.list(12, &[]),
            self.list(11, &variables),
        ]
        .concat()
    }

    fn variable(&self, variable: &Var, begin: &mut u64, data_from: u64) -> Vec<u8> {
        let lengths = variable.dimensions.iter().filter_map(|number| self.dimensions.get(*number as usize));
        let bytes = lengths.map(|(_, length)| (*length).max(1)).fold(variable.kind.bytes(), u64::wrapping_mul);
        let bytes = bytes.next_multiple_of(4);
        let at = variable.absolute.unwrap_or(if variable.begin > 0 { data_from + variable.begin } else { *begin });
        *begin += bytes;
        let attributes: Vec<_> = variable.attributes.iter().map(|attribute| self.attribute(attribute)).collect();
        let at = if self.version == 1 { (at as u32).to_be_bytes().to_vec() } else { at.to_be_bytes().to_vec() };
        [
            self.name(variable.name),
            self.size(variable.dimensions.len() as u64),
            variable.dimensions.iter().flat_map(|number| self.size(*number)).collect(),
            self.list(12, &attributes),
            variable.kind.code().to_be_bytes().to_vec(),
            self.size(variable.bytes.unwrap_or(bytes)),
            at,
        ]
        .concat()
    }

    fn attribute(&self, (name, kind, bytes): &(&str, Type, Vec<u8>)) -> Vec<u8> {
        let count = self.size(bytes.len() as u64 / kind.bytes());
        [self.name(name), kind.code().to_be_bytes().to_vec(), count, padded(bytes)].concat()
    }
}

fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}
