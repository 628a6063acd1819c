//! Remarks that state what was done with a file as it is, and call for nothing.

/// Behind a column of times.
pub(crate) const AS_RATE: &str = "given as the sample rate, not as a channel";
/// Behind an array of times.
pub(crate) const OF_ITS_LENGTH: &str = "the sample rate of the arrays of its length";
/// Of rounded times.
pub(crate) const KNOWN_TO: &str = "is rounded: the sample rate is known to";
/// Behind the location of one number.
pub(crate) const ONE_NUMBER: &str = "is the single number";
/// Behind the location of a text.
const ONE_TEXT: &str = "is the text";
/// Of a number that is named like a rate.
pub(crate) const RATE_FROM: &str = "the sampling rate is taken from";
/// Of the first line of MAT-files.
pub(crate) const HEADER_SAYS: &str = "the file's header says";
/// Of channels that begin at different instants: what puts them together takes that out.
pub(crate) const BEGINS_LATER: &str = "s after the first channel";
/// What was taken for granted: no mere fact.
pub(crate) const TAKEN_AS_SECONDS: &str = "(no unit: taken as seconds)";
/// Likewise of a rate.
pub(crate) const TAKEN_AS_HERTZ: &str = "(no unit: taken as hertz)";

/// Whether a remark of a reader states a mere fact of the file: `afmid inspect` shows it, a run need not warn of it.
pub fn is_fact(remark: &str) -> bool {
    let facts = [AS_RATE, OF_ITS_LENGTH, KNOWN_TO, ONE_NUMBER, ONE_TEXT, RATE_FROM, HEADER_SAYS, BEGINS_LATER];
    let guesses = [TAKEN_AS_SECONDS, TAKEN_AS_HERTZ];
    facts.iter().any(|fact| remark.contains(fact)) && !guesses.iter().any(|guess| remark.contains(guess))
}

/// What is said of a short text.
pub(crate) fn remark_on_text(location: &str, text: &str) -> String {
    format!("{location} {ONE_TEXT} \"{}\"", text.escape_debug())
}
