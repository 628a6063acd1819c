//! The preamble of a Tektronix waveform.

use crate::number::Number;
use crate::opened::Opened;
use crate::text::{brief, decode, number};
use crate::{FormatError, fail};

/// Preambles are shorter.
const LONGEST: u64 = 1 << 16;

/// What a preamble says.
#[derive(Debug)]
pub(super) struct Preamble {
    /// Keys in upper case without the command they belong to, and their values; the last of a key holds.
    fields: Vec<(String, String)>,
    /// Byte behind the word CURVE.
    pub(super) curve_at: u64,
    /// Whether each pair of codes is a minimum and a maximum.
    pub(super) envelope: bool,
    /// WFID: source, coupling and scales, for people.
    pub(super) description: String,
}

/// Where the codes are.
#[derive(Debug)]
pub(super) enum Data {
    Codes { number: Number, big_endian: bool, from: u64, count: u64 },
    Text(Vec<f64>),
}

/// Whether a file begins like a preamble.
pub(super) fn is_begin(head: &[u8]) -> bool {
    let head = head.get(..head.len().min(16)).unwrap_or_default().trim_ascii_start().to_ascii_uppercase();
    let head = head.strip_prefix(b":").unwrap_or(&head);
    [&b"WFMP:"[..], b"WFMPRE:", b"WFMO:", b"WFMOUTPRE:"].into_iter().any(|begin| head.starts_with(begin))
}

impl Preamble {
    /// Reads it. Errors: it does not begin or end as one.
    pub(super) fn read(file: &Opened) -> Result<Self, FormatError> {
        let head = file.head(LONGEST)?;
        if !is_begin(&head) {
            let problem = "found no «:WFMPRE:» or «:WFMP:», wanted a waveform with a preamble";
            return Err(fail::at(0, problem, fail::COPY_AGAIN));
        }
        let mut fields = Vec::new();
        let mut at = 0;
        loop {
            let rest = head.get(at..).unwrap_or_default();
            let end = field_end(rest);
            let field = rest.get(..end).unwrap_or_default();
            let text = decode(field);
            let (command, value) = text.trim().split_once([' ', '\t']).unwrap_or((text.trim(), ""));
            let key = command.rsplit(':').next().unwrap_or_default().to_ascii_uppercase();
            if key.starts_with("CURV") {
                // the value begins behind the blank that follows the word
                let blank = field.iter().position(|byte| matches!(byte, b' ' | b'\t')).unwrap_or(end);
                let get = |short: &str| find(&fields, short).unwrap_or_default().to_owned();
                let (envelope, description) = (get("PT_F").to_ascii_uppercase().starts_with("ENV"), get("WFI"));
                return Ok(Self {
                    fields,
                    curve_at: (at + blank) as u64,
                    envelope,
                    description: brief(&description, 200),
                });
            }
            fields.push((key, value.trim().trim_matches('"').to_owned()));
            at += end + 1;
            if at >= head.len() {
                return Err(fail::at(
                    at as u64,
                    "found no «CURVE» behind the preamble, wanted samples",
                    fail::COPY_AGAIN,
                ));
            }
        }
    }

    /// The value of a key that begins with its short form.
    fn get(&self, short: &str) -> Option<&str> {
        find(&self.fields, short).filter(|value| !value.is_empty())
    }

    fn number(&self, short: &str, otherwise: f64) -> Result<f64, FormatError> {
        let Some(text) = self.get(short) else { return Ok(otherwise) };
        number(text).ok_or_else(|| {
            let problem = format!("found {short} «{}» in the preamble, wanted a number", brief(text, 40));
            fail::at(0, problem, fail::COPY_AGAIN)
        })
    }

    /// Factor and offset of value = code * factor + offset. Errors: they are no numbers.
    pub(super) fn scale(&self) -> Result<(f64, f64), FormatError> {
        let (factor, zero, offset) = (self.number("YMU", 1.0)?, self.number("YZE", 0.0)?, self.number("YOF", 0.0)?);
        if factor == 0.0 {
            return Err(fail::at(0, "found YMULT 0 in the preamble, wanted another number", fail::COPY_AGAIN));
        }
        Ok((factor, zero - offset * factor))
    }

    pub(super) fn unit(&self) -> String {
        brief(self.get("YUN").unwrap_or_default(), 20)
    }

    /// Seconds between codes.
    pub(super) fn step_s(&self, remarks: &mut Vec<String>) -> Option<f64> {
        let (step, unit) = (self.get("XIN").unwrap_or_default(), self.get("XUN").unwrap_or_default());
        let step_s = number(step).filter(|step| *step > 0.0 && unit.eq_ignore_ascii_case("s"));
        if step_s.is_none() {
            let (step, unit) = (brief(step, 40), brief(unit, 20));
            remarks
                .push(format!("no sample rate: the preamble says steps of «{step}» in «{unit}», wanted a step in s"));
        }
        step_s
    }

    /// The source's name: the first words of WFID, up to a comma.
    pub(super) fn source(&self) -> String {
        let name = self.description.split(',').next().unwrap_or_default().trim();
        if name.is_empty() { "trace".to_owned() } else { brief(name, 20) }
    }

    /// The codes. Errors: kinds that are not known; a block that is none.
    pub(super) fn data(&self, file: &Opened, remarks: &mut Vec<String>) -> Result<Data, FormatError> {
        let encoding = self.get("ENC").unwrap_or("BIN").to_ascii_uppercase();
        if encoding.starts_with("ASC") {
            return self.text(file);
        }
        let format = self.get("BN_F").unwrap_or("RI").to_ascii_uppercase();
        let bytes = self.get("BYT_N").unwrap_or("1");
        let number = match (format.as_str(), bytes) {
            ("RI", "1") => Number::I8,
            ("RI", "2") => Number::I16,
            ("RI", "4") => Number::I32,
            ("RP", "1") => Number::U8,
            ("RP", "2") => Number::U16,
            ("RP", "4") => Number::U32,
            ("FP", "4") => Number::F32,
            _ => {
                let (format, bytes) = (brief(&format, 10), brief(bytes, 10));
                let problem = format!("found codes of kind «{format}» with «{bytes}» bytes, wanted RI, RP or FP");
                return Err(fail::at(0, problem, "save it in binary with 1 or 2 bytes a point"));
            }
        };
        let big_endian = self.is_big_endian()?;
        let (from, stated) = block(file, self.curve_at)?;
        self.check_width(number, stated)?;
        let there = file.bytes().saturating_sub(from);
        let stated = stated.unwrap_or(there);
        if stated > there {
            let stated = format!("the file is cut off: its header says {stated} bytes of samples, there are {there}");
            remarks.push(stated);
        }
        let count = stated.min(there) / number.bytes();
        if let Some(points) = self.get("NR_P").and_then(crate::text::number).filter(|points| *points != count as f64) {
            remarks.push(format!("the preamble says {points} points, there are {count}"));
        }
        Ok(Data::Codes { number, big_endian, from, count })
    }

    /// Errors: neither of the two byte orders.
    fn is_big_endian(&self) -> Result<bool, FormatError> {
        let order = self.get("BYT_O").unwrap_or("MSB").to_ascii_uppercase();
        match order.as_str() {
            "MSB" => Ok(true),
            "LSB" => Ok(false),
            _ => {
                let problem =
                    format!("found the byte order «{}» in the preamble, wanted MSB or LSB", brief(&order, 10));
                Err(fail::at(0, problem, fail::COPY_AGAIN))
            }
        }
    }

    /// Errors: the bits or the number of points say that codes have another width than the bytes do.
    fn check_width(&self, number: Number, block_bytes: Option<u64>) -> Result<(), FormatError> {
        let bytes = number.bytes();
        let stated = |key| self.get(key).and_then(crate::text::number);
        let problem = match (stated("BIT_N"), stated("NR_P"), block_bytes) {
            (Some(bits), ..) if bits != 8.0 * bytes as f64 => {
                format!("found BIT_NR {bits} and BYT_NR {bytes} in the preamble, wanted {} bits", 8 * bytes)
            }
            (_, Some(points), Some(block))
                if !self.envelope
                    && points > 0.0
                    && [1.0, 2.0, 4.0].iter().any(|&w| w != bytes as f64 && w * points == block as f64) =>
            {
                format!("found BYT_NR {bytes} and {points} points in a block of {block} bytes, wanted {bytes} a point")
            }
            _ => return Ok(()),
        };
        Err(fail::at(0, problem, fail::COPY_AGAIN))
    }

    /// Codes as text, set apart by commas.
    fn text(&self, file: &Opened) -> Result<Data, FormatError> {
        let bytes = file.read("samples", self.curve_at, file.bytes().saturating_sub(self.curve_at))?;
        let text = decode(&bytes);
        let code = |(place, field): (usize, &str)| {
            number(field).ok_or_else(|| {
                let problem = format!("found «{}» as code {}, wanted a number", brief(field.trim(), 40), place + 1);
                fail::at(self.curve_at, problem, fail::COPY_AGAIN)
            })
        };
        let end = text.trim_end_matches(|c: char| c.is_whitespace() || c == ';' || c == ',');
        end.split(',').enumerate().map(code).collect::<Result<_, _>>().map(Data::Text)
    }
}

/// The last value of a key that begins with the short form.
fn find<'a>(fields: &'a [(String, String)], short: &str) -> Option<&'a str> {
    fields.iter().rev().find(|(key, _)| key.starts_with(short)).map(|(_, value)| value.as_str())
}

/// Bytes up to the next semicolon outside quotes, or to the `#` of a block.
fn field_end(rest: &[u8]) -> usize {
    let mut quoted = false;
    for (at, byte) in rest.iter().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b';' | b'#' if !quoted => return at,
            _ => {}
        }
    }
    rest.len()
}

/// First byte and length of the block of bytes behind byte `at`: `#520000` has 5 digits, `#0` goes to the end.
fn block(file: &Opened, at: u64) -> Result<(u64, Option<u64>), FormatError> {
    let head = file.read("the block of samples", at, 16.min(file.bytes().saturating_sub(at)))?;
    let wrong = || {
        let problem = format!("found «{}», wanted a block of bytes as «#520000»", brief(&decode(&head), 16));
        fail::at(at, problem, fail::COPY_AGAIN)
    };
    let blanks = head.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    let [b'#', digits, rest @ ..] = head.get(blanks..).unwrap_or_default() else { return Err(wrong()) };
    let digits = usize::from(digits.wrapping_sub(b'0'));
    let from = at + (blanks + 2 + digits) as u64;
    if digits == 0 {
        return Ok((from, None));
    }
    let length = rest.get(..digits).filter(|_| digits <= 9).and_then(|text| std::str::from_utf8(text).ok());
    let length = length.and_then(|text| text.parse().ok()).ok_or_else(wrong)?;
    Ok((from, Some(length)))
}
