//! "Did you mean": the nearest of the names that exist.

/// Problems of one kind that come with a look at all `items` that there are: each looks at all of them, a million in
/// sum, and more than a hundred problems are not printed.
pub(crate) fn most_helped(items: usize) -> usize {
    (1_000_000 / items.max(1)).clamp(10, 200)
}

/// Names that are listed; more are counted.
const MOST_LISTED: usize = 40;

/// The candidate nearest to a word, if one is near: a misspelling of up to a third of its letters, another case, `-`
/// for `_`, or the last part of a dotted name.
///
/// ```
/// use afmid_pipeline::config::nearest;
/// assert_eq!(nearest("fiels", ["files", "channel"]), Some("files"));
/// assert_eq!(nearest("correlation", ["events.correlation", "io.records"]), Some("events.correlation"));
/// assert_eq!(nearest("order", ["files", "channel"]), None);
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = normal(word);
    let limit = (wanted.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter_map(|candidate| {
            let have = normal(candidate);
            let last = have.rsplit('.').next().unwrap_or(&have);
            let tail = if wanted.contains('.') { usize::MAX } else { strsim::damerau_levenshtein(&wanted, last) };
            let distance = strsim::damerau_levenshtein(&wanted, &have).min(tail);
            (distance <= limit).then_some((distance, candidate))
        })
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// Help for a word that does not exist: the nearest candidate, or what there is.
pub(crate) fn did_you_mean<'a>(word: &str, what: &str, candidates: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(word, candidates.clone()) {
        Some(candidate) => format!("did you mean `{candidate}`?"),
        None => match list(candidates) {
            names if names.is_empty() => format!("there is no {what}"),
            names => format!("there is: {names}"),
        },
    }
}

/// Names in backquotes, separated by commas, the first forty.
pub(crate) fn list<'a>(names: impl Iterator<Item = &'a str> + Clone) -> String {
    let more = names.clone().skip(MOST_LISTED).count();
    let listed = names.take(MOST_LISTED).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if more == 0 { listed } else { format!("{listed} and {more} more") }
}

/// Whether a key that is missing is there under a misspelt name: then that is said already.
pub(crate) fn misspelt(key: &str, known: &[&str], entries: &toml::de::DeTable<'_>) -> bool {
    let unknown = entries.iter().map(|(name, _)| name.get_ref().as_ref()).filter(|name| !known.contains(name));
    unknown.into_iter().any(|name| nearest(name, known.iter().copied()) == Some(key))
}

fn normal(word: &str) -> String {
    word.to_lowercase().replace('-', "_")
}
