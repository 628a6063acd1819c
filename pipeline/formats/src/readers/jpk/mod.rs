//! JPK (Bruker) NanoWizard force curves, maps of them and quantitative imaging: `.jpk-force`, `.jpk-force-map`,
//! `.jpk-qi-data`, `.jpk-qi-series`.
//!
//! Source: the layout and the property names as the readers afmformats (`fmt_jpk`, with an example header,
//! <https://github.com/AFM-analysis/afmformats>), Gwyddion (`jpkscan.c`) and Hooke use them; no public specification
//! was found. A map and a series of quantitative imaging were at hand.
//!
//! - A zip archive: `header.properties`; per segment (extend, pause, retract) `segments/N/segment-header.properties`
//!   and big-endian samples in `segments/N/channels/*.dat`; in files of version 2 what segments share is in
//!   `shared-data/header.properties`.
//! - One channel per segment and quantity: `/segments/0/vDeflection`, in the base unit (V), which the encoder's
//!   multiplier and offset give. Each calibration that is defined is a channel as well, from the same samples:
//!   `/segments/0/vDeflection/force`.
//!   The chain of conversions is put together into one straight line.
//! - The sample rate is the segment's number of points by its duration.
//! - Maps (`.jpk-force-map`, `.jpk-qi-data`) hold curves, each like a file of its own: `/index/3/segments/0/vDeflection`.
//!   Of a map with very many only the first curves are listed. Images beside the curves are left out.

mod archive;
mod channel;
mod conversions;
mod properties;
mod segment;

use std::collections::BTreeSet;
use std::path::Path;

use crate::{Contents, Format, FormatError, Row};

use crate::archive::{Archive, MAGIC};
use crate::fail;
use crate::text;
use properties::{Properties, Table};

/// JPK force curves.
pub struct JpkForce;

/// Beyond this many channels no further curve is listed: 10,000 curves would be half a million.
const MOST_CHANNELS: usize = 1 << 15;

impl Format for JpkForce {
    const ROW: Row = Row {
        name: "jpk",
        title: "JPK force curves and maps",
        reads: "`.jpk-force`, `.jpk-qi-series`: segments, encoders, calibrations as channels of their own; \
                `.jpk-force-map`, `.jpk-qi-data`: the same for each curve, `/index/3/segments/0/vDeflection`",
        leaves_out: "images beside the curves; of a map with very many curves all but the first",
        described_by: "no public description: as afmformats, Gwyddion and Hooke read it",
        clock: "duration and number of points of each segment",
        unit: "of each calibration",
    };

    fn recognises(head: &[u8], path: &Path) -> bool {
        let holds = |name: &[u8]| head.windows(name.len()).any(|w| w == name);
        head.starts_with(MAGIC)
            && (text::extension(path).starts_with("jpk") || holds(b"segments/0/") || holds(b"header.properties"))
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let mut archive = Archive::open(path)?;
        let names = archive::names(&archive);
        let segments = segment::all(names.iter().map(String::as_str));
        if segments.is_empty() {
            return Err(refuse(&names));
        }
        let general = archive::table(&mut archive, "header.properties")?.unwrap_or_default();
        let shared = archive::table(&mut archive, "shared-data/header.properties")?.unwrap_or_default();
        let mut remarks = Vec::new();
        let mut channels = Vec::new();
        let mut started_at = String::new();
        let curves = segments.iter().filter_map(|segment| segment.curve).collect::<BTreeSet<u32>>().len();
        let mut latest = None;
        for segment in segments {
            // whole curves: a half would be taken for a whole one
            if channels.len() > MOST_CHANNELS && segment.curve != latest {
                remarks.push(format!(
                    "the curves from number {} on are left out: too many to list",
                    segment.curve.unwrap_or(0)
                ));
                break;
            }
            latest = segment.curve;
            let table = archive::table(&mut archive, &segment.header_name())?.unwrap_or_default();
            let properties = Properties::new(table, &shared);
            if started_at.is_empty() {
                started_at = properties.get("force-segment-header.time-stamp").and_then(iso).unwrap_or_default();
            }
            segment::channels(&mut archive, segment, &properties, &mut channels, &mut remarks)?;
        }
        let version = general.get("file-format-version").or_else(|| shared.get("file-format-version"));
        Ok(Contents {
            format: format_name(version, curves, &shared),
            started_at,
            channels,
            responses: Vec::new(),
            remarks,
        })
    }
}

fn format_name(version: Option<&String>, curves: usize, shared: &Table) -> String {
    let what = if curves > 0 { format!("map of {curves} force curves") } else { "force curve".to_owned() };
    let layout = if shared.is_empty() { "" } else { ", shared headers" };
    format!(
        "JPK {what} {}{layout}, big-endian",
        version.map_or("of unknown version".to_owned(), |v| text::brief(v, 20))
    )
}

/// Why an archive without segments is not read.
fn refuse(names: &[String]) -> FormatError {
    fail::plain(
        format!(
            "found an archive of {} entries without `segments/0/segment-header.properties`, wanted a JPK force curve",
            names.len()
        ),
        "name a .jpk-force file",
    )
}

/// `2016-02-05 13:27:32 +0100` as ISO 8601; none if it is written otherwise.
fn iso(stamp: &str) -> Option<String> {
    let words: Vec<&str> = stamp.split_whitespace().collect();
    let [date, clock, zone @ ..] = words.as_slice() else { return None };
    let shape = |text: &str, pattern: &str| {
        text.len() >= pattern.len()
            && text.bytes().zip(pattern.bytes()).all(|(t, p)| if p == b'0' { t.is_ascii_digit() } else { t == p })
    };
    if !(shape(date, "0000-00-00") && date.len() == 10 && shape(clock, "00:00:00") && clock.len() <= 20) {
        return None;
    }
    // a zone by name is left out: names are ambiguous
    let zone = zone
        .first()
        .filter(|z| z.len() == 5 && z.starts_with(['+', '-']) && z.bytes().skip(1).all(|b| b.is_ascii_digit()));
    let zone = zone.and_then(|z| Some(format!("{}:{}", z.get(..3)?, z.get(3..)?))).unwrap_or_default();
    Some(format!("{date}T{clock}{zone}"))
}

#[cfg(test)]
mod tests {
    use super::iso;

    #[test]
    fn time_stamps_become_iso_8601() {
        assert_eq!(iso("2016-02-05 13:27:32 +0100").as_deref(), Some("2016-02-05T13:27:32+01:00"));
        assert_eq!(iso("2016-02-05 13:27:32.125 UTC").as_deref(), Some("2016-02-05T13:27:32.125"));
        assert_eq!(iso("Fri Feb 05 2016"), None);
        assert_eq!(iso(""), None);
    }
}
