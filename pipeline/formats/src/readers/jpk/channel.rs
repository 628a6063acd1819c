//! How a channel's samples are stored: type and encoder.

use super::conversions::{Line, scaling};
use super::properties::Properties;
use crate::number::Number;
use crate::text;

/// How samples are stored and what line leads to the base unit.
#[derive(Debug)]
pub(super) struct Encoding {
    pub(super) code: Number,
    pub(super) line: Line,
    pub(super) unit: String,
}

/// A property of a channel, which is below `data.` in files without shared headers.
pub(super) fn get<'p>(properties: &'p Properties<'_>, channel: &str, key: &str) -> Option<&'p str> {
    properties
        .get(&format!("channel.{channel}.data.{key}"))
        .or_else(|| properties.get(&format!("channel.{channel}.{key}")))
}

/// The encoding of a channel. Errors: why it has none that is known.
pub(super) fn encoding(properties: &Properties<'_>, channel: &str) -> Result<Encoding, String> {
    let kind = get(properties, channel, "type").unwrap_or_default();
    let Some(encoder) = get(properties, channel, "encoder.type") else { return plain(properties, channel, kind) };
    // a limited encoder clips instead of wrapping when it writes: no difference to a reader
    let code = match encoder.strip_suffix("-limited").unwrap_or(encoder) {
        "signedshort" => Number::I16,
        "unsignedshort" => Number::U16,
        "signedinteger" => Number::I32,
        "unsignedinteger" => Number::U32,
        "signedlong" => Number::I64,
        "unsignedlong" => Number::U64,
        _ => {
            return Err(format!(
                "its encoder is `{}`, none of signed and unsigned short, integer and long",
                text::brief(encoder, 40)
            ));
        }
    };
    let width = ["short", "integer", "long"].iter().find(|width| kind.starts_with(**width));
    if let Some(width) = width.filter(|width| !encoder.contains(**width)) {
        let (kind, encoder) = (text::brief(kind, 40), text::brief(encoder, 40));
        return Err(format!("its type is `{kind}` and its encoder `{encoder}`, wanted one of {width}"));
    }
    let own = format!("channel.{channel}.data.encoder.scaling");
    let key = if properties.get(&format!("{own}.multiplier")).is_some() {
        own
    } else {
        format!("channel.{channel}.encoder.scaling")
    };
    let (line, unit) = scaling(properties, &key)?;
    if line.factor == 0.0 {
        return Err("its multiplier is 0".to_owned());
    }
    Ok(Encoding { code, line, unit })
}

/// Samples without an encoder: floating-point numbers in the base unit.
fn plain(properties: &Properties<'_>, channel: &str, kind: &str) -> Result<Encoding, String> {
    let code = match kind {
        "float" | "float-data" => Number::F32,
        "double" | "double-data" => Number::F64,
        "constant-data" | "raster-data" => {
            let of = |key| {
                get(properties, channel, key).map(|v| format!(", {key} {}", text::brief(v, 40))).unwrap_or_default()
            };
            return Err(format!(
                "it has no samples but is computed ({kind}{}{}{})",
                of("value"),
                of("start"),
                of("step")
            ));
        }
        _ => {
            return Err(format!(
                "its type is `{}` without an encoder, wanted floating-point numbers then",
                text::brief(kind, 40)
            ));
        }
    };
    let unit = get(properties, channel, "unit.unit").or_else(|| get(properties, channel, "unit")).unwrap_or_default();
    Ok(Encoding { code, line: Line::SAME, unit: unit.to_owned() })
}
