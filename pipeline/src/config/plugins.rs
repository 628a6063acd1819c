//! The `[plugins]` table: commands of the stages that run as processes of their own.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::problem::Problem;
use super::suggest::did_you_mean;
use super::value::{found, integer};

/// A plugin as a config declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct PluginDecl {
    /// Its name: `exec:NAME` runs it.
    pub name: String,
    /// The program and its arguments; relative paths are taken from the config's folder.
    pub command: Vec<String>,
    /// Variables of its environment, beside those that the program itself has; by name.
    pub environment: BTreeMap<String, String>,
    /// Whether it may write to its own temporary folder alone, and use no TCP.
    pub confined: bool,
    /// How long one request may take, in seconds.
    pub timeout_s: f64,
    /// Bytes of its name.
    pub key_span: Range<usize>,
    /// Bytes of its command.
    pub command_span: Range<usize>,
}

/// How long a plugin may take over one request where nothing is said: ten minutes.
pub const DEFAULT_TIMEOUT_S: f64 = 600.0;

/// A week: more is a slip.
const MOST_TIMEOUT_S: f64 = 604_800.0;

const KEYS: [&str; 4] = ["command", "confined", "environment", "timeout_s"];

const FORM: &str =
    "write `NAME = \"python3 my_stage.py\"` or `NAME = { command = [\"python3\", \"my_stage.py\"], timeout_s = 600 }`";

/// Reads the table, in the order of the text.
pub(super) fn read(value: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) -> Vec<PluginDecl> {
    let Some(table) = value.get_ref().as_table() else {
        let message = format!("`plugins`: found {}, wanted a table", found(value.get_ref()));
        problems.push(Problem::new(message, value.span(), "wanted a table").help(FORM));
        return Vec::new();
    };
    let mut plugins = Vec::new();
    for (key, value) in table {
        let name = key.get_ref().to_string();
        if !is_name(&name) {
            let message = format!("`{name}` cannot be the name of a plugin");
            let help = "names are of lowercase letters, digits, `-` and `_`, and begin with a letter";
            problems.push(Problem::new(message, key.span(), "not a name").help(help));
            continue;
        }
        match plugin(&name, key.span(), value, problems) {
            Ok(plugin) => plugins.push(plugin),
            Err(problem) => problems.push(problem),
        }
    }
    plugins.sort_by_key(|plugin| plugin.key_span.start);
    plugins
}

/// Whether a word can be a plugin's name: it becomes the name of a program, `afmid-stage-NAME`.
pub(crate) fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_lowercase())
        && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || matches!(byte, b'-' | b'_'))
}

fn plugin(
    name: &str,
    key_span: Range<usize>,
    value: &Spanned<DeValue<'_>>,
    problems: &mut Vec<Problem>,
) -> Result<PluginDecl, Problem> {
    let mut confined = true;
    let (mut timeout_s, mut environment, mut line) = (DEFAULT_TIMEOUT_S, BTreeMap::new(), Some(value));
    if let Some(long) = value.get_ref().as_table() {
        line = long.get("command");
        for (key, value) in long {
            match key.get_ref().as_ref() {
                "command" => {}
                "confined" => confined = flag(name, value)?,
                "environment" => environment = variables(name, value)?,
                "timeout_s" => timeout_s = timeout(name, value)?,
                other => problems.push(unknown(name, other, key.span())),
            }
        }
    }
    let Some(line) = line else {
        let lacks = Problem::new(format!("plugin `{name}` has no `command`"), value.span(), "lacks `command`");
        return Err(lacks.help(FORM));
    };
    let command = command(name, line)?;
    Ok(PluginDecl {
        name: name.to_owned(),
        command,
        environment,
        confined,
        timeout_s,
        key_span,
        command_span: line.span(),
    })
}

fn unknown(name: &str, key: &str, span: Range<usize>) -> Problem {
    let help = did_you_mean(key, "key", KEYS.into_iter());
    Problem::new(format!("plugin `{name}` has no key `{key}`"), span, "unknown key").help(help)
}

fn timeout(name: &str, value: &Spanned<DeValue<'_>>) -> Result<f64, Problem> {
    let seconds = match value.get_ref() {
        DeValue::Integer(number) => integer(number).map(|number| number as f64),
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    };
    seconds.filter(|seconds| *seconds > 0.0 && *seconds <= MOST_TIMEOUT_S).ok_or_else(|| {
        let found = found(value.get_ref());
        let message = format!("`timeout_s` of plugin `{name}`: found {found}, wanted seconds above 0, at most a week");
        Problem::new(message, value.span(), "not a time limit")
    })
}

fn flag(name: &str, value: &Spanned<DeValue<'_>>) -> Result<bool, Problem> {
    value.get_ref().as_bool().ok_or_else(|| {
        let message = format!("`confined` of plugin `{name}`: found {}, wanted true or false", found(value.get_ref()));
        Problem::new(message, value.span(), "no flag")
    })
}

fn variables(name: &str, value: &Spanned<DeValue<'_>>) -> Result<BTreeMap<String, String>, Problem> {
    let wrong = |what: String, span: Range<usize>| {
        Problem::new(format!("`environment` of plugin `{name}`: {what}"), span, "no variable")
            .help("write `environment = { OMP_NUM_THREADS = \"1\" }`: names, and texts without a NUL")
    };
    let Some(table) = value.get_ref().as_table() else {
        return Err(wrong(format!("found {}, wanted a table", found(value.get_ref())), value.span()));
    };
    let variable = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let name: &std::borrow::Cow<'_, str> = key.get_ref();
        if name.is_empty() || name.contains(['=', '\0']) {
            return Err(wrong(format!("`{name}` cannot be the name of a variable"), key.span()));
        }
        match value.get_ref().as_str().filter(|text| !text.contains('\0')) {
            Some(text) => Ok((name.to_string(), text.to_owned())),
            None => Err(wrong(format!("`{name}`: found {}, wanted text", found(value.get_ref())), value.span())),
        }
    };
    table.iter().map(variable).collect()
}

fn command(name: &str, value: &Spanned<DeValue<'_>>) -> Result<Vec<String>, Problem> {
    let wrong = |what: String, span: Range<usize>, label: &str| {
        Problem::new(format!("the command of plugin `{name}`: {what}"), span, label).help(FORM)
    };
    let words = match value.get_ref() {
        DeValue::String(line) => words(line).map_err(|what| wrong(what, value.span(), "not a command"))?,
        DeValue::Array(words) => words
            .iter()
            .map(|word| match word.get_ref().as_str() {
                Some(text) => Ok(text.to_owned()),
                None => Err(wrong(format!("found {}, wanted text", found(word.get_ref())), word.span(), "wanted text")),
            })
            .collect::<Result<_, _>>()?,
        other => {
            return Err(wrong(format!("found {}, wanted text or an array", found(other)), value.span(), "no command"));
        }
    };
    match words.first() {
        Some(program) if !program.is_empty() => Ok(words),
        _ => Err(wrong("it is empty".to_owned(), value.span(), "no program")),
    }
}

/// The words of a line, at white space; quotes hold words together. There is no shell.
fn words(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut word, mut quote): (Vec<String>, Option<String>, Option<char>) = (Vec::new(), None, None);
    for c in line.chars() {
        match (c, quote) {
            (c, Some(open)) if c == open => quote = None,
            ('"' | '\'', None) => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (c, None) if c.is_whitespace() => words.extend(word.take()),
            (c, _) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    match quote {
        Some(open) => Err(format!("a quote {open} is not closed")),
        None => Ok(words),
    }
}

/// The declared names, for suggestions.
pub(crate) fn names(plugins: &[PluginDecl]) -> impl Iterator<Item = &str> + Clone {
    plugins.iter().map(|plugin| plugin.name.as_str())
}

#[cfg(test)]
mod tests {
    use super::{is_name, words};

    #[test]
    fn quotes_hold_words_together() {
        assert_eq!(
            words("python3  'my stage.py' \"\" -x"),
            Ok(["python3", "my stage.py", "", "-x"].map(str::to_owned).to_vec())
        );
        assert!(words("python3 'open").is_err());
    }

    #[test]
    fn a_name_is_part_of_a_file_name() {
        assert!(is_name("my-stage_2"));
        assert!(!is_name("../evil") && !is_name("A") && !is_name("") && !is_name("2x"));
    }
}
