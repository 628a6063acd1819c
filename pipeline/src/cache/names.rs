//! The names that the cache gives its files. What has another name is none of its own.

use crate::files::TemporaryName;

/// A folder of stamps: what the files of earlier runs hashed to.
pub(super) const STAMPS: &str = "stamps";

/// What a file of the cache is, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind<'a> {
    /// The result with this key.
    Result(&'a str),
    /// The origin of the result with this key.
    Origin(&'a str),
    /// Being written, or left by a killed run.
    Temporary(TemporaryName<'a>),
}

/// What a file with this name is; none if it is not the cache's.
pub(super) fn kind_of(name: &str) -> Option<Kind<'_>> {
    if name.starts_with('.') {
        let temporary = TemporaryName::parse(name)?;
        let own = matches!(temporary.target.split_once('.'), Some((key, "h5" | "json")) if is_key(key));
        return own.then_some(Kind::Temporary(temporary));
    }
    match name.split_once('.')? {
        (key, "h5") if is_key(key) => Some(Kind::Result(key)),
        (key, "json") if is_key(key) => Some(Kind::Origin(key)),
        _ => None,
    }
}

/// BLAKE3 in lowercase hexadecimal.
pub(super) fn is_key(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Whether a file in the folder of stamps is one: its name is a hash, of earlier versions with an ending.
pub(super) fn is_stamp(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default();
    stem.len() >= 32 && stem.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// The temporary name of a stamp.
pub(super) fn temporary_stamp(name: &str) -> Option<TemporaryName<'_>> {
    TemporaryName::parse(name).filter(|temporary| is_stamp(temporary.target))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_the_cache_gives_are_its_own() {
        let key = "0123456789abcdef".repeat(4);
        assert_eq!(kind_of(&format!("{key}.h5")), Some(Kind::Result(&key)));
        assert_eq!(kind_of(&format!("{key}.json")), Some(Kind::Origin(&key)));
        for temporary in ["h5.0123456789ab.12-34.0.tmp", "json.0123456789ab.12.0.tmp"] {
            assert!(matches!(kind_of(&format!(".{key}.{temporary}")), Some(Kind::Temporary(_))), "{temporary}");
        }
        let others = [
            "thesis.h5".to_owned(),
            key.clone(),
            format!("{key}.txt"),
            format!("{key}.h5.bak"),
            format!("{}.h5", key.to_uppercase()),
            format!("{}.h5", &key[1..]),
            ".thesis.tmp".to_owned(),
            format!(".{key}.h5"),
            format!(".{key}.h5.mine.tmp"),
            format!(".{key}.h5.host-1.12.0.tmp"),
            ".result.h5.0123456789ab.12.0.tmp".to_owned(),
            String::new(),
            "..".to_owned(),
        ];
        for other in others {
            assert_eq!(kind_of(&other), None, "{other}");
        }
        assert!(is_stamp(&key) && is_stamp(&format!("{key}.json")) && !is_stamp("notes.txt") && !is_stamp("cafe"));
        assert!(temporary_stamp(&format!(".{key}.0123456789ab.1-2.3.tmp")).is_some());
        assert!(temporary_stamp(&format!(".{key}.tmp")).is_none());
    }
}
