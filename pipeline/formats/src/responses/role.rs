//! What a column's title says that it is.

use crate::FoundChannel;
use crate::frequency::hertz;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Frequency,
    Real,
    Imaginary,
    Amplitude,
    Decibels,
    Phase,
    Coherence,
}

/// Words of titles, in lower case.
const WORDS: [(Role, &[&str]); 7] = [
    (Role::Coherence, &["coherence", "coh"]),
    (Role::Phase, &["phase", "phi", "angle", "arg", "pha", "theta"]),
    (Role::Decibels, &["db"]),
    (Role::Imaginary, &["imaginary", "imag", "im", "i"]),
    (Role::Real, &["real", "re", "r"]),
    (Role::Amplitude, &["amplitude", "amp", "magnitude", "mag", "abs", "modulus", "gain"]),
    (Role::Frequency, &["frequency", "frequencies", "freq", "freqs", "hz", "khz"]),
];

/// Words beside them in titles that are no name.
const BESIDE: [&str; 6] = ["deg", "degree", "degrees", "rad", "radians", "shift"];

/// The role that title or unit state, and what is left of the title: the name of the response.
pub(super) fn role(channel: &FoundChannel) -> (Option<Role>, String) {
    let split = |text: &str| -> Vec<String> {
        text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
    };
    let said = |words: &[String]| {
        WORDS.iter().find(|(_, known)| words.iter().any(|word| known.contains(&word.as_str()))).map(|(role, _)| *role)
    };
    let mut words = split(&channel.long_name);
    if said(&words).is_none() {
        words = split(&channel.location);
    }
    let (titled, unit) = (said(&words), channel.unit.to_lowercase());
    let by_unit = match unit.as_str() {
        // of volts, of milliwatts, «dB re 1 m/N»: of the same shape
        unit if unit.starts_with("db") => Some(Role::Decibels),
        "deg" | "°" | "º" | "rad" | "degree" | "degrees" | "radian" | "radians" => Some(Role::Phase),
        _ if hertz(&channel.unit).is_some() => Some(Role::Frequency),
        _ => None,
    };
    let found = match (titled, by_unit) {
        // an amplitude in decibels
        (Some(Role::Amplitude), Some(Role::Decibels)) => Some(Role::Decibels),
        (titled, by_unit) => titled.or(by_unit),
    };
    let known = |word: &&String| {
        WORDS.iter().any(|(_, known)| known.contains(&word.as_str())) || BESIDE.contains(&word.as_str())
    };
    (found, words.iter().filter(|word| !known(word)).cloned().collect::<Vec<String>>().join(" "))
}

/// Whether a phase is in degrees; none if neither title nor unit say.
pub(super) fn degrees(channel: &FoundChannel) -> Option<bool> {
    let says = format!("{} {}", channel.unit, channel.long_name).to_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| says.contains(word));
    match (has(&["deg", "°", "º"]), has(&["rad"])) {
        (true, false) => Some(true),
        (false, true) => Some(false),
        _ => None,
    }
}
