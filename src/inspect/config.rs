//! The stage of a config that reads a file.

use std::path::Path;

use super::channel::Channel;

/// The `io.records` stage that reads a channel of a file, with the parameters that it needs; what only the user knows
/// is left to fill in.
pub fn stage(path: &Path, channel: &Channel, resample: bool) -> String {
    // a config's paths begin at its folder, which is not known here
    let file = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut lines = vec![
        "[[stage]]".to_owned(),
        "id = \"records\"".to_owned(),
        "uses = \"io.records\"".to_owned(),
        String::new(),
        "[stage.params]".to_owned(),
        format!("files = [{}]", text(&file.to_string_lossy())),
        format!("channel = {}", text(&channel.location)),
    ];
    if resample {
        lines.push("resample = true".to_owned());
    }
    if channel.sample_rate_hz.is_none() {
        lines.push("# sample_rate_hz = ...  # the file states none: fill it in".to_owned());
    }
    if channel.unit.is_empty() {
        lines.push("# unit = \"...\"  # the file states none: fill it in".to_owned());
    }
    lines.join("\n") + "\n"
}

/// A TOML string of one line, whatever the text. JSON's escapes are TOML's, which wants one more.
fn text(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::toml::Table;

    #[test]
    fn any_text_is_read_as_it_was() {
        for wanted in ["C:\\a \"b\" 'c'", "two\nlines\r\n\t\u{7f}\u{1b}\0", "\u{b5}m \u{1f600} \u{85}", ""] {
            let line = format!("a = {}", super::text(wanted));
            assert_eq!(line.lines().count(), 1, "{line}");
            assert_eq!(line.parse::<Table>().unwrap()["a"].as_str(), Some(wanted), "{line}");
        }
    }
}
