//! What a terminal or a page shows instead of obeying it.
//!
//! Names, units, warnings and messages come from files of anybody. Characters in them that act (escape sequences move
//! the cursor and rename the window, bidirectional marks turn text round) or are not seen (of no width, so that two
//! names look alike) are shown as escapes, `\x1b`, `\u{202e}` or `\u{200b}`.
//! Everything that is printed goes through [`printable`] in `output`, everything on a page through it in `report`.

use std::borrow::Cow;
use std::path::Path;

/// Whether a character acts instead of being seen: controls but for the line's end and the tabulator, separators of
/// lines and paragraphs, and what Unicode calls Default_Ignorable_Code_Point (DerivedCoreProperties.txt): marks and
/// overrides of direction, joiners and blanks of no width, selectors, tags.
pub fn acts(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(
            c,
            '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}'
                | '\u{180b}'..='\u{180f}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{ffa0}'
                | '\u{fff0}'..='\u{fffb}' | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}'
                | '\u{e0000}'..='\u{e0fff}'
        )
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

/// Warnings of a stage that are printed or shown on a page: more than a screen of them nobody reads.
const MOST_WARNINGS: usize = 20;

/// The first warnings of a stage, each as one line, and how many more its result holds.
pub fn few(warnings: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = warnings.iter().take(MOST_WARNINGS).map(|warning| one_line(warning)).collect();
    if warnings.len() > MOST_WARNINGS {
        let more = warnings.len() - MOST_WARNINGS;
        lines.push(format!("and {more} more: `afmid show RESULT --json` lists those that are kept"));
    }
    lines
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
    // beyond the basic plane JSON has two escapes of four digits
    let escapes = |c: char| c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect();
    let shown = |c: char| if acts(c) { escapes(c) } else { c.to_string() };
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
        assert_eq!(printable("a\u{200b}\u{feff}b\u{ad}\u{e0041}"), "a\\u{200b}\\u{feff}b\\u{ad}\\u{e0041}");
        for plain in ["", "\u{b5}m, \u{3b1}\n\tx", "\u{65e5}\u{672c} \u{1f600} \u{2026} e\u{301}"] {
            assert!(matches!(printable(plain), Cow::Borrowed(same) if same == plain));
        }
    }

    #[test]
    fn a_name_stays_one_line() {
        assert_eq!(one_line("a\r\nverdict: right\t1\u{1b}"), "a\\nverdict: right\\t1\\x1b");
    }

    #[test]
    fn the_first_warnings_are_shown_and_the_others_counted() {
        let warnings: Vec<String> = (0..22).map(|number| format!("no\n{number}")).collect();
        let shown = few(&warnings);
        assert_eq!((shown.len(), shown[19].as_str()), (21, "no\\n19"));
        assert!(shown[20].starts_with("and 2 more"), "{}", shown[20]);
        assert_eq!(few(&warnings[..20]).len(), 20);
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
        let value = serde_json::json!({ "a\u{202e}": "\u{1b}\u{7f}\u{85}\u{2066}\u{200b}\u{e0041}\"\\" });
        let text = serde_json::to_string_pretty(&value).unwrap();
        let shown = printable_json(&text);
        assert!(!shown.contains(acts) && shown.contains("\\u202e") && shown.contains("\\u0085"), "{shown}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }
}
