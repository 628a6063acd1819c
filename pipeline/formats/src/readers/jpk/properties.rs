//! Java property files, and JPK's references from a segment's to those that segments share.

use std::collections::BTreeMap;

/// Keys and values.
pub(super) type Table = BTreeMap<String, String>;

/// Reads a Java property file: Latin-1, `key=value` or `key:value`, comments, escapes, continued lines.
pub(super) fn parse(bytes: &[u8]) -> Table {
    let text: String = bytes.iter().map(|&b| char::from(b)).collect();
    let mut table = Table::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let mut line = line.trim_start().to_owned();
        if line.is_empty() || line.starts_with(['#', '!']) {
            continue;
        }
        while line.bytes().rev().take_while(|&b| b == b'\\').count() % 2 == 1 {
            line.pop();
            let Some(next) = lines.next() else { break };
            line.push_str(next.trim_start());
        }
        let (key, value) = split(&line);
        table.insert(unescape(key), unescape(value));
    }
    table
}

/// At the first separator that is not escaped: `=`, `:` or a blank.
fn split(line: &str) -> (&str, &str) {
    let mut escaped = false;
    for (at, c) in line.char_indices() {
        if !escaped && (matches!(c, '=' | ':') || c.is_whitespace()) {
            let (key, rest) = line.split_at(at);
            let rest = rest.trim_start();
            return (key, rest.strip_prefix(['=', ':']).unwrap_or(rest).trim_start());
        }
        escaped = c == '\\' && !escaped;
    }
    (line, "")
}

fn unescape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next() {
            Some('n') => out.push('\n'),
            Some('t') => out.push('\t'),
            Some('r') => out.push('\r'),
            Some('u') => {
                let code: String = chars.by_ref().take(4).collect();
                out.push(
                    u32::from_str_radix(&code, 16).ok().and_then(char::from_u32).unwrap_or(char::REPLACEMENT_CHARACTER),
                );
            }
            Some(other) => out.push(other),
            None => {}
        }
    }
    out
}

/// A segment's properties with those it refers to: `channel.x.lcd-info.*=3` stands for all of `lcd-info.3.` below
/// `channel.x.`.
#[derive(Debug)]
pub(super) struct Properties<'a> {
    own: Table,
    /// What is put in front of which shared keys: `channel.x.` and `lcd-info.3.`.
    references: Vec<(String, String)>,
    shared: &'a Table,
}

impl<'a> Properties<'a> {
    /// Finds the references in a segment's table.
    pub(super) fn new(own: Table, shared: &'a Table) -> Self {
        let reference = |(key, index): (&String, &String)| {
            let (prefix, group) = key.strip_suffix(".*")?.rsplit_once('.')?;
            Some((format!("{prefix}."), format!("{group}.{}.", index.trim())))
        };
        /// Real segments have one per channel and a few more; every look-up tries all.
        const MOST: usize = 1024;
        let references = own.iter().filter_map(reference).take(MOST).collect();
        Self { own, references, shared }
    }

    /// A value, own or shared.
    pub(super) fn get(&self, key: &str) -> Option<&str> {
        let shared = || {
            let rests = self
                .references
                .iter()
                .filter_map(|(prefix, group)| Some(format!("{group}{}", key.strip_prefix(prefix.as_str())?)));
            rests.filter_map(|key| self.shared.get(&key)).next()
        };
        self.own.get(key).or_else(shared).map(String::as_str)
    }

    /// Keys of the segment itself.
    pub(super) fn own_keys(&self) -> impl Iterator<Item = &str> {
        self.own.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_files_are_read_as_java_does() {
        let table = parse(b"#c\n!c\n a = 1\nb:2\nc 3\nd\\=e=f\\u00b5\\n\nlong=x\\\n   y\nempty\nback=\\\\\nlast=\\");
        let get = |k: &str| table.get(k).map(String::as_str);
        assert_eq!([get("a"), get("b"), get("c"), get("d=e")], [Some("1"), Some("2"), Some("3"), Some("fµ\n")]);
        assert_eq!([get("long"), get("empty"), get("back"), get("last")], [Some("xy"), Some(""), Some("\\"), Some("")]);
    }

    #[test]
    fn shared_properties_are_found_through_references_and_one_is_not_ten() {
        let shared = parse(b"lcd-info.1.type=short\nlcd-info.10.type=long\n");
        let properties =
            Properties::new(parse(b"channel.x.lcd-info.*=1\nchannel.y.lcd-info.*=10\nchannel.y.name=own"), &shared);
        assert_eq!(properties.get("channel.x.type"), Some("short"));
        assert_eq!(properties.get("channel.y.type"), Some("long"));
        assert_eq!(properties.get("channel.y.name"), Some("own"));
        assert_eq!(properties.get("channel.z.type"), None);
    }
}
