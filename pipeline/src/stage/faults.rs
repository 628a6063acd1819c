//! What is wrong with a stage's parameters, all of it at once.

use crate::error::StageError;

/// Faults found by [`Stage::check`](super::Stage::check), in the order in which they were found.
#[derive(Debug, Default)]
pub struct Faults(Vec<StageError>);

impl Faults {
    /// Adds what was found and what was wanted, unless the condition holds.
    pub fn require(&mut self, holds: bool, problem: impl FnOnce() -> String) {
        if !holds {
            self.add(StageError::new(problem()));
        }
    }

    /// Adds a fault.
    pub fn add(&mut self, error: StageError) {
        self.0.push(error);
    }

    /// Adds the error of a check that stops at its first.
    pub fn take(&mut self, result: Result<(), impl Into<StageError>>) {
        self.0.extend(result.err().map(Into::into));
    }

    /// All of them.
    pub fn into_errors(self) -> Vec<StageError> {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_kept_in_its_order() {
        let mut faults = Faults::default();
        faults.require(true, || unreachable!("made only where it fails"));
        faults.require(1 > 2, || "first".to_owned());
        faults.take(Ok::<(), StageError>(()));
        faults.take(Err(StageError::new("second")));
        faults.add(StageError::new("third").help("do this"));
        let found: Vec<String> = faults.into_errors().iter().map(ToString::to_string).collect();
        assert_eq!(found, ["first", "second", "third"]);
    }
}
