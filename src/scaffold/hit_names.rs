//! Whether files are hits by their names.

use std::path::PathBuf;

/// Words before the number of a hit, or of a take.
const HITS: [&str; 15] = [
    "hit", "hits", "impact", "tap", "strike", "blow", "shot", "knock", "take", "trial", "rep", "repeat", "average",
    "schlag", "coup",
];

/// Whether the names of files differ in the number of a hit alone: `hit_1.csv`, `beam impact 03.csv`.
pub fn are_hits(files: &[PathBuf]) -> bool {
    let names = files.iter().map(|file| parts(&file.file_stem().unwrap_or_default().to_string_lossy().to_lowercase()));
    let names: Vec<Vec<String>> = names.collect();
    let Some((first, others)) = names.split_first() else { return false };
    if others.iter().any(|other| other.len() != first.len()) {
        return false;
    }
    let differs = |at: &usize| others.iter().any(|other| other.get(*at) != first.get(*at));
    let differing: Vec<usize> = (0..first.len()).filter(differs).collect();
    let [at] = differing[..] else { return false };
    let is_number = |part: &String| part.starts_with(|c: char| c.is_ascii_digit());
    let word = at.checked_sub(1).and_then(|before| first.get(before)).map(String::as_str).unwrap_or_default();
    let last = word.split(|c: char| !c.is_alphabetic()).rfind(|word| !word.is_empty()).unwrap_or_default();
    names.iter().all(|name| name.get(at).is_some_and(is_number)) && HITS.contains(&last)
}

/// Numbers, and what lies between them.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut before = None;
    for letter in name.chars() {
        let digit = letter.is_ascii_digit();
        match parts.last_mut().filter(|_| before == Some(digit)) {
            Some(part) => part.push(letter),
            None => parts.push(letter.to_string()),
        }
        before = Some(digit);
    }
    parts
}

#[cfg(test)]
#[test]
fn hits_are_numbered_as_hits_and_nothing_else_differs() {
    let are = |names: &[&str]| are_hits(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
    assert!(are(&["hit_1.csv", "hit_2.csv", "hit_10.csv"]));
    assert!(are(&["Beam 3 Impact-01.mat", "Beam 3 Impact-02.mat"]));
    for others in [
        &["p1.csv", "p2.csv"][..],
        &["point1_hit1.csv", "point2_hit1.csv"],
        &["point1_hit1.csv", "point2_hit2.csv"],
        &["hit_1.csv", "hit_b.csv"],
        &["white1.csv", "white2.csv"],
        &["1.csv", "2.csv"],
    ] {
        assert!(!are(others), "{others:?}");
    }
}
