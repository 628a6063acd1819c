//! What a terminal or a page shows instead of obeying it.
//!
//! Names, units, warnings and messages come from files of anybody. Characters in them that act (escape sequences move
//! the cursor and rename the window, bidirectional marks turn text round) are shown as escapes, `\x1b` or `\u{202e}`.
//! Everything that is printed goes through [`printable`] in `output`, everything on a page through it in `report`.

use std::borrow::Cow;
use std::path::Path;

/// Whether a character acts instead of being seen: controls but for the line's end and the tabulator, marks and
/// overrides of direction, separators of lines and paragraphs.
fn acts(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with an escape for each character that acts. Ends of lines of other systems (`\r\n`) become line ends.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let text = text.replace("\r\n", "\n");
    let shown = |c: char| match c {
        c if !acts(c) => c.to_string(),
        c if c.is_ascii() => format!("\\x{:02x}", u32::from(c)),
        c => format!("\\u{{{:x}}}", u32::from(c)),
    };
    Cow::Owned(text.chars().map(shown).collect())
}

/// The same of what is one line, such as a name or a cell: ends of lines and tabulators are escapes, too. A name could
/// otherwise add lines of its own.
pub fn one_line(text: &str) -> String {
    printable(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// A file's name in a line.
pub fn shown(path: &Path) -> String {
    one_line(&path.display().to_string())
}

/// What stands before the lines that a plugin wrote to stderr.
const STDERR: &str = "; its stderr ends with:\n";

/// A message: one line, and below it what a plugin wrote to stderr, if the message ends with that, each line of it
/// set off.
pub fn message(text: &str) -> String {
    let Some((first, lines)) = text.split_once(STDERR) else { return one_line(text.trim_end()) };
    let line = |line: &str| format!("\n    {}", one_line(line.strip_prefix("  ").unwrap_or(line)));
    one_line(first) + STDERR.trim_end() + &lines.lines().map(line).collect::<String>()
}

/// The line below a message that says what to do. Lines of its own are set off below it.
pub fn help_line(help: &str) -> String {
    let lines: Vec<String> = help.trim_end().lines().map(one_line).collect();
    format!("  help: {}\n", lines.join("\n        "))
}

/// JSON with the escapes of JSON for the same characters, which it may hold in its strings alone. (Below a blank it has
/// escapes already.)
pub fn printable_json(json: &str) -> Cow<'_, str> {
    if !json.contains(acts) {
        return Cow::Borrowed(json);
    }
    // all of them are in the basic plane: four digits
    let shown = |c: char| if acts(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(json.chars().map(shown).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_acts_is_shown_and_the_rest_stays() {
        assert_eq!(printable("a\u{1b}[31m\u{7f}\u{9b}\0"), "a\\x1b[31m\\x7f\\u{9b}\\x00");
        assert_eq!(printable("\u{202e}\u{61c}\u{2028}\u{2069}"), "\\u{202e}\\u{61c}\\u{2028}\\u{2069}");
        assert_eq!(printable("one\r\ntwo\rthree"), "one\ntwo\\x0dthree");
        for plain in ["", "\u{b5}m, \u{3b1}\n\tx", "\u{65e5}\u{672c} \u{1f600} \u{2026} \u{2060}"] {
            assert!(matches!(printable(plain), Cow::Borrowed(same) if same == plain));
        }
    }

    #[test]
    fn a_name_stays_one_line() {
        assert_eq!(one_line("a\r\nverdict: right\t1\u{1b}"), "a\\nverdict: right\\t1\\x1b");
    }

    #[test]
    fn a_message_has_no_lines_of_a_name_s() {
        assert_eq!(message("a\nerror: b\n"), "a\\nerror: b");
        let plugin = "the plugin `a\nb` ended; its stderr ends with:\n  Traceback:\nerror: x";
        let wanted = "the plugin `a\\nb` ended; its stderr ends with:\n    Traceback:\n    error: x";
        assert_eq!(message(plugin), wanted);
        assert_eq!(help_line("one\ntwo"), "  help: one\n        two\n");
    }

    #[test]
    fn json_stays_json() {
        let value = serde_json::json!({ "a\u{202e}": "\u{1b}\u{7f}\u{85}\u{2066}\"\\" });
        let text = serde_json::to_string_pretty(&value).unwrap();
        let shown = printable_json(&text);
        assert!(!shown.contains(acts) && shown.contains("\\u202e") && shown.contains("\\u0085"), "{shown}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }
}
