//! Straight lines from codes to the base unit and on to calibrated ones.

use super::properties::Properties;
use crate::text;

/// value = code * factor + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) factor: f64,
    pub(super) offset: f64,
}

impl Line {
    /// The line that leaves values as they are.
    pub(super) const SAME: Self = Self { factor: 1.0, offset: 0.0 };

    /// This line, then the next.
    fn then(self, next: Self) -> Self {
        Self { factor: self.factor * next.factor, offset: self.offset * next.factor + next.offset }
    }
}

/// A calibration of a channel.
#[derive(Debug)]
pub(super) struct Slot {
    pub(super) name: String,
    pub(super) line: Line,
    pub(super) unit: String,
}

/// The scaling below a key, with its unit. Errors: why it is no straight line.
pub(super) fn scaling(properties: &Properties<'_>, key: &str) -> Result<(Line, String), String> {
    let get = |rest: &str| properties.get(&format!("{key}.{rest}"));
    let unit = get("unit.unit").or_else(|| get("unit")).unwrap_or_default().to_owned();
    let (kind, style) = (get("type").unwrap_or("linear"), get("style").unwrap_or("offsetmultiplier"));
    if kind != "linear" || style != "offsetmultiplier" {
        return Err(format!(
            "its scaling is {kind}, {style}, no straight line by offset and multiplier",
            kind = text::brief(kind, 40),
            style = text::brief(style, 40)
        ));
    }
    let number = |rest: &str| match get(rest) {
        Some(stated) => {
            text::number(stated).ok_or_else(|| format!("its {rest} is `{}`, no number", text::brief(stated, 40)))
        }
        None => Err(format!("its {rest} is missing")),
    };
    Ok((Line { factor: number("multiplier")?, offset: number("offset")? }, unit))
}

/// Real channels have two or three calibrations.
const MOST_SLOTS: usize = 32;

/// The defined calibrations of a channel: lines from codes, given the line from codes to the base. Others are remarked.
pub(super) fn slots(
    properties: &Properties<'_>,
    channel: &str,
    base: Line,
    whose: &str,
    remarks: &mut Vec<String>,
) -> Vec<Slot> {
    let set = format!("channel.{channel}.conversion-set");
    let base_name = properties.get(&format!("{set}.conversions.base")).unwrap_or_default();
    let list = properties.get(&format!("{set}.conversions.list")).unwrap_or_default();
    let mut found = Vec::new();
    for name in list.split_whitespace().filter(|&name| name != base_name).take(MOST_SLOTS) {
        match chain(properties, &set, base_name, name) {
            Ok(Some((line, unit))) => found.push(Slot { name: text::brief(name, 60), line: base.then(line), unit }),
            Ok(None) => remarks.push(format!("{whose} has no calibration `{}`", text::brief(name, 60))),
            Err(why) => remarks.push(format!("{whose}: calibration `{}` is left out: {why}", text::brief(name, 60))),
        }
    }
    found
}

/// The line from the base to a calibration; none if it is not defined.
fn chain(properties: &Properties<'_>, set: &str, base: &str, wanted: &str) -> Result<Option<(Line, String)>, String> {
    /// Real chains have two or three links (volts, distance, force); more is a circle.
    const MOST_LINKS: usize = 16;
    let mut line = Line::SAME;
    let mut unit = None;
    let mut name = wanted;
    for _ in 0..MOST_LINKS {
        let key = format!("{set}.conversion.{name}");
        if properties.get(&format!("{key}.defined")) == Some("false") {
            return Ok(None);
        }
        let (link, link_unit) = scaling(properties, &format!("{key}.scaling"))?;
        line = link.then(line);
        unit.get_or_insert(link_unit);
        name = properties.get(&format!("{key}.base-calibration-slot")).unwrap_or(base);
        if name == base {
            let sound = line.factor.is_finite() && line.factor != 0.0 && line.offset.is_finite();
            return if sound {
                Ok(Some((line, unit.unwrap_or_default())))
            } else {
                Err("its factor is 0 or too large".to_owned())
            };
        }
    }
    Err(format!("its chain of conversions does not lead to `{}`", text::brief(base, 40)))
}
