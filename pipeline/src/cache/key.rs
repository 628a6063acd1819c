//! Keys: the content address of a stage's result.

use blake3::Hasher;
use serde_json::Value;

use crate::outcome::SourceFile;
use crate::store::FORMAT_VERSION;

/// Everything that a stage's result depends on.
#[derive(Debug, Clone, Copy)]
pub struct KeyParts<'a> {
    /// The stage's name in the registry.
    pub stage: &'a str,
    /// The stage's version.
    pub version: u32,
    /// All parameters, defaults filled in.
    pub params: &'a Value,
    /// Names of parameters that say where data lies: left out.
    pub location_params: &'a [&'a str],
    /// What else the result depends on: plugins of the stage with their versions.
    pub depends_on: &'a [String],
    /// What of processor and build may change last bits: see [`arithmetic`](super::arithmetic()).
    pub arithmetic: &'a str,
    /// The seed, if the stage draws random numbers.
    pub seed: Option<u64>,
    /// The files that it reads, in order: names without folders, and hashes, count.
    pub sources: &'a [SourceFile],
    /// Per wired input, in a fixed order: input port, key of the stage that it comes from, output port there.
    pub upstream: &'a [(String, String, String)],
}

/// The content address of a stage's result, in hexadecimal.
///
/// Method: BLAKE3 over a canonical serialisation: every text with its length in front, objects with sorted keys.
pub fn key(parts: &KeyParts) -> String {
    let mut hasher = Hasher::new();
    text(&mut hasher, "afmid stage result");
    number(&mut hasher, u64::from(FORMAT_VERSION));
    text(&mut hasher, parts.stage);
    number(&mut hasher, u64::from(parts.version));
    params(&mut hasher, parts.params, parts.location_params);
    if !parts.depends_on.is_empty() {
        text(&mut hasher, "depends on");
        number(&mut hasher, parts.depends_on.len() as u64);
        parts.depends_on.iter().for_each(|other| text(&mut hasher, other));
    }
    text(&mut hasher, parts.arithmetic);
    number(&mut hasher, u64::from(parts.seed.is_some()));
    number(&mut hasher, parts.seed.unwrap_or(0));
    number(&mut hasher, parts.sources.len() as u64);
    for file in parts.sources {
        text(&mut hasher, file.path.rsplit(['/', '\\']).next().unwrap_or_default());
        text(&mut hasher, &file.blake3);
    }
    number(&mut hasher, parts.upstream.len() as u64);
    for (port, key, output) in parts.upstream {
        text(&mut hasher, port);
        text(&mut hasher, key);
        text(&mut hasher, output);
    }
    hasher.finalize().to_hex().to_string()
}

fn params(hasher: &mut Hasher, params: &Value, left_out: &[&str]) {
    match params {
        Value::Object(map) => {
            let kept = map.iter().filter(|(name, _)| !left_out.contains(&name.as_str()));
            value(hasher, &Value::Object(kept.map(|(name, value)| (name.clone(), value.clone())).collect()));
        }
        other => value(hasher, other),
    }
}

fn value(hasher: &mut Hasher, json: &Value) {
    match json {
        Value::Null => text(hasher, "null"),
        Value::Bool(flag) => text(hasher, if *flag { "true" } else { "false" }),
        Value::Number(number) => {
            text(hasher, "number");
            text(hasher, &number.to_string());
        }
        Value::String(string) => {
            text(hasher, "string");
            text(hasher, string);
        }
        Value::Array(items) => {
            text(hasher, "array");
            number(hasher, items.len() as u64);
            items.iter().for_each(|item| value(hasher, item));
        }
        Value::Object(map) => {
            text(hasher, "object");
            number(hasher, map.len() as u64);
            let mut members: Vec<_> = map.iter().collect();
            members.sort_unstable_by_key(|(name, _)| name.as_str());
            for (name, member) in members {
                text(hasher, name);
                value(hasher, member);
            }
        }
    }
}

fn text(hasher: &mut Hasher, text: &str) {
    number(hasher, text.len() as u64);
    hasher.update(text.as_bytes());
}

fn number(hasher: &mut Hasher, number: u64) {
    hasher.update(&number.to_le_bytes());
}
