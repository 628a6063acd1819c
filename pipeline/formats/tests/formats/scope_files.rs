//! Builders of waveforms of oscilloscopes.
#![allow(dead_code, reason = "each test binary uses a part of it")]

/// What differs between the LeCroy waveforms of the tests.
#[derive(Clone)]
pub struct Trace {
    pub big_endian: bool,
    pub words: bool,
    pub codes: Vec<i16>,
    pub segments: u32,
    pub horizontal_unit: &'static str,
    pub record_type: u16,
    pub template: &'static str,
}

impl Default for Trace {
    fn default() -> Self {
        Self {
            big_endian: false,
            words: true,
            codes: vec![0, 1, -1, 100, -100, 7],
            segments: 1,
            horizontal_unit: "S",
            record_type: 0,
            template: "LECROY_2_3",
        }
    }
}

impl Trace {
    /// The file: a block header, the descriptor, a text of 6 bytes, times of segments, samples.
    pub fn file(&self) -> Vec<u8> {
        let order = |bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            if self.big_endian {
                bytes.reverse();
            }
            bytes
        };
        let mut d = vec![0_u8; 346];
        let mut put = |at: usize, bytes: &[u8]| d[at..at + bytes.len()].copy_from_slice(bytes);
        let samples: Vec<u8> = if self.words {
            self.codes.iter().flat_map(|code| order(&code.to_le_bytes())).collect()
        } else {
            self.codes.iter().map(|code| *code as u8).collect()
        };
        let times = if self.segments > 1 { 16 * self.segments } else { 0 };
        put(0, b"WAVEDESC");
        put(16, self.template.as_bytes());
        put(32, &order(&u16::from(self.words).to_le_bytes()));
        put(34, &order(&u16::from(!self.big_endian).to_le_bytes()));
        put(36, &order(&346_u32.to_le_bytes()));
        put(40, &order(&6_u32.to_le_bytes()));
        put(48, &order(&times.to_le_bytes()));
        put(60, &order(&(samples.len() as u32).to_le_bytes()));
        put(76, b"LECROYTEST");
        put(116, &order(&(self.codes.len() as u32).to_le_bytes()));
        put(144, &order(&self.segments.to_le_bytes()));
        put(156, &order(&0.5_f32.to_le_bytes()));
        put(160, &order(&2_f32.to_le_bytes()));
        put(176, &order(&1e-6_f32.to_le_bytes()));
        put(196, b"V");
        put(244, self.horizontal_unit.as_bytes());
        put(296, &order(&4.5_f64.to_le_bytes()));
        put(304, &[3, 2, 1, 12]);
        put(308, &order(&2020_u16.to_le_bytes()));
        put(316, &order(&self.record_type.to_le_bytes()));
        put(344, &order(&2_u16.to_le_bytes()));
        let length = d.len() + 6 + times as usize + samples.len();
        [format!("#9{length:09}").into_bytes(), d, b"a text".to_vec(), vec![9; times as usize], samples].concat()
    }
}

/// A waveform of a Keysight or Rigol file: label, kind, segment and, of each buffer, kind and values.
pub type Wave<'a> = (&'a str, u32, u32, Vec<(u16, Vec<f32>)>);

/// The file. Sizes have 64 bits if `wide`.
pub fn bin_file(mark: &[u8; 4], wide: bool, waves: &[Wave]) -> Vec<u8> {
    let size =
        |bytes: usize| if wide { (bytes as u64).to_le_bytes().to_vec() } else { (bytes as u32).to_le_bytes().to_vec() };
    let mut out = [mark.to_vec(), size(0), (waves.len() as u32).to_le_bytes().to_vec()].concat();
    for (label, kind, segment, buffers) in waves {
        let mut header = vec![0_u8; 140];
        let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, &140_u32.to_le_bytes());
        put(4, &kind.to_le_bytes());
        put(8, &(buffers.len() as u32).to_le_bytes());
        put(32, &2e-6_f64.to_le_bytes());
        put(48, &2_u32.to_le_bytes());
        put(52, &1_u32.to_le_bytes());
        put(56, b"22 NOV 2020");
        put(72, b"19:02:34");
        put(88, b"MODEL:SERIAL");
        put(112, label.as_bytes());
        put(136, &segment.to_le_bytes());
        out.extend(header);
        for (kind, values) in buffers {
            let bytes: Vec<u8> = if *kind == 6 {
                values.iter().map(|value| *value as u8).collect()
            } else {
                values.iter().flat_map(|value| value.to_le_bytes()).collect()
            };
            let width: u16 = if *kind == 6 { 1 } else { 4 };
            let header_bytes: u32 = if wide { 16 } else { 12 };
            out.extend(header_bytes.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend(width.to_le_bytes());
            out.extend(size(bytes.len()));
            out.extend(bytes);
        }
    }
    out
}

/// A Tektronix file: preamble and what follows the word CURVE.
pub fn isf_file(preamble: &str, curve: &[u8]) -> Vec<u8> {
    [preamble.as_bytes(), b";:CURVE ", curve].concat()
}
