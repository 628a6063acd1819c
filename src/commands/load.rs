//! From a config file to a plan.

use std::path::Path;

use afmid_pipeline::Plan;
use afmid_pipeline::files::read_regular;
use afmid_pipeline::graph::{self, Stages};

use crate::diagnostic::render;
use crate::failure::{Failure, Message};

/// Reads a config, applies `--set` arguments and plans it. Errors: the file cannot be read; everything that is wrong
/// with it.
pub fn load(path: &Path, set: &[String], stages: &dyn Stages) -> Result<Plan, Failure> {
    let file = path.display().to_string();
    let text = read(path)?;
    plan_text(&file, &text, set, stages)
}

/// Plans a config from its text; `file` is what messages call it. Errors: everything that is wrong with it.
pub fn plan_text(file: &str, text: &str, set: &[String], stages: &dyn Stages) -> Result<Plan, Failure> {
    graph::load(file, text, set, stages)
        .map_err(|problems| Failure::Usage(Message::Styled(render(file, text, &problems))))
}

/// The largest config: a hundred thousand stages.
const MOST_BYTES: u64 = 8 << 20;

/// The text of a config. Errors: the file cannot be read, is no regular one, has more than 8 MiB, or is no text.
pub fn read(path: &Path) -> Result<String, Failure> {
    let bytes = read_regular(path, MOST_BYTES)
        .map_err(|error| Failure::usage(format!("the config {} cannot be read: {error}", path.display()), None))?;
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let message = format!("the config {} is not UTF-8 text: byte {place} begins no character", path.display());
        Failure::usage(message, Some("a config is a TOML file".to_owned()))
    })
}
