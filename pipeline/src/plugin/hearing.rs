//! A conversation without a process: what would be believed of the lines that a plugin says. The door for the fuzz
//! targets and the replay of their corpus; nothing else calls it.

use std::path::Path;

use serde_json::Value;

use super::describe::checked;
use super::error::PluginError;
use super::process::{Line, read_lines};
use super::session::{handshake, reply};
use super::stage::outputs;
use crate::outcome::Ports;

/// The longest line here.
const MOST_BYTES: usize = 1 << 20;

/// Hears a stream as that of a plugin that was started, asked to describe itself and asked to run once with its
/// defaults; `file` is its output file. What it made, and its warnings.
///
/// Errors: whatever such a plugin would be refused for.
pub fn hear(stream: &[u8], file: &Path) -> Result<(Ports, Vec<String>), String> {
    let refused = |error: PluginError| format!("{}; {}", error.message_for("heard"), error.help);
    let mut lines = Vec::new();
    read_lines(stream, MOST_BYTES, |line| {
        lines.push(line);
        true
    });
    let mut lines = lines.into_iter();
    let (shaken, _) = handshake(&text(lines.next())?).map_err(refused)?;
    let answer = answer(&mut lines, 1, "during `describe`")?;
    let (description, schema) = checked(&shaken, &answer).map_err(refused)?;
    // what a config says of no parameter at all
    let params = schema.resolve(Value::Object(serde_json::Map::new())).unwrap_or_default();
    let _ = (schema.paths(&params), schema.manual());
    let answer = self::answer(&mut lines, 2, "during `run`")?;
    outputs(&description.outputs, answer, file)
}

/// The result that answers request `id`; progress before it is passed over.
fn answer(lines: &mut impl Iterator<Item = Line>, id: u64, doing: &str) -> Result<Value, String> {
    loop {
        let reply = reply(&text(lines.next())?, id, doing).map_err(|error| error.message_for("heard"))?;
        match (reply.progress, reply.result, reply.error) {
            (Some(_), None, None) => {}
            (None, Some(result), None) => return Ok(result),
            (None, None, Some(refusal)) => return Err(refusal.message),
            _ => return Err("answered with none or several of `result`, `error`, `progress`".to_owned()),
        }
    }
}

fn text(line: Option<Line>) -> Result<String, String> {
    match line {
        Some(Line::Text(text)) => Ok(text),
        Some(Line::NotText(line)) => Err(format!("a line that is not UTF-8: {line}")),
        Some(Line::TooLong(line)) => Err(format!("a line that is too long: {line}")),
        Some(Line::CutShort(line)) => Err(format!("a line without an end: {line}")),
        None => Err("it ended".to_owned()),
    }
}
