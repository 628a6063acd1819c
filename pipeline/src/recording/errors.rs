//! Errors of readers of files are errors of the stage that reads, and the other way round for sources that the store
//! opens.

use super::FormatError;
use crate::error::StageError;

impl From<FormatError> for StageError {
    fn from(error: FormatError) -> Self {
        let at = error.at_byte.map(|byte| format!(", at byte {byte}")).unwrap_or_default();
        let mut stage = Self::new(format!("{}{at}", error.problem));
        stage.place = error.file;
        stage.help = error.help;
        stage
    }
}

impl From<StageError> for FormatError {
    fn from(error: StageError) -> Self {
        Self { file: error.place, at_byte: None, problem: error.problem, help: error.help }
    }
}
