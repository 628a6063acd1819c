//! Causes of others beside the built-in ones.

use std::cell::RefCell;
use std::sync::{PoisonError, RwLock};

use super::{CATALOGUE, Cause, Identifiable, Scene, within_limits};
use afmid_kernels::effects::Effects;

thread_local! {
    /// Those of [`with`], for what runs on this thread.
    static HERE: RefCell<Listed> = const { RefCell::new(Vec::new()) };
}

/// Causes with their versions.
type Listed = Vec<(&'static dyn Cause, u32)>;

static ADDED: RwLock<Listed> = RwLock::new(Vec::new());

/// Why a cause was not added.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CauseError {
    /// Its id is taken.
    #[error("there is a cause named `{0}` already; ids are unique")]
    Double(&'static str),
    /// What it says of itself does not hold.
    #[error("cause `{0}`: {1}")]
    Wrong(&'static str, String),
}

/// Adds a cause of one's own to this process: `simulate.afm` can hide it from now on, and the diagnosis names it like
/// any other.
///
/// `version` is part of the content address of whatever may use it: raise it when the same numbers mean another effect.
/// # Errors
/// An id that is taken or no lower-case word; a text that is missing; limits that are no range; trials outside them, or
/// that add nothing.
pub fn add(cause: &'static dyn Cause, version: u32) -> Result<(), CauseError> {
    let id = cause.about().id;
    holds(cause).map_err(|reason| CauseError::Wrong(id, reason))?;
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    if CATALOGUE.iter().chain(added.iter().map(|(cause, _)| cause)).any(|known| known.about().id == id) {
        return Err(CauseError::Double(id));
    }
    added.push((cause, version));
    Ok(())
}

/// What `work` returns with further causes in the catalogue of this thread, for as long as it takes: others of the same
/// names may be tried at the same time elsewhere.
/// # Errors
/// As [`add`].
pub fn with<T>(causes: Vec<(&'static dyn Cause, u32)>, work: impl FnOnce() -> T) -> Result<T, CauseError> {
    let mut known: Vec<&'static str> = catalogue().iter().map(|cause| cause.about().id).collect();
    for (cause, _) in &causes {
        let id = cause.about().id;
        holds(*cause).map_err(|reason| CauseError::Wrong(id, reason))?;
        if known.contains(&id) {
            return Err(CauseError::Double(id));
        }
        known.push(id);
    }
    /// Takes them off again, also where the work panics.
    struct Until(usize);
    impl Drop for Until {
        fn drop(&mut self) {
            HERE.with_borrow_mut(|here| here.truncate(self.0));
        }
    }
    let _until = Until(HERE.with_borrow(Vec::len));
    HERE.with_borrow_mut(|here| here.extend(causes));
    Ok(work())
}

/// Those that were added to this process or are tried by this thread, in their order.
fn others() -> Listed {
    let mut others = ADDED.read().unwrap_or_else(PoisonError::into_inner).clone();
    HERE.with_borrow(|here| others.extend_from_slice(here));
    others
}

/// Every cause: the built-in ones, then those that were added, in their order.
pub fn catalogue() -> Vec<&'static dyn Cause> {
    CATALOGUE.iter().copied().chain(others().into_iter().map(|(cause, _)| cause)).collect()
}

/// Those that were added, with their versions: what results depend on beside the program.
pub fn added() -> Vec<String> {
    others().iter().map(|(cause, version)| format!("cause {} {version}", cause.about().id)).collect()
}

/// The cause of that id.
pub fn find(id: &str) -> Option<&'static dyn Cause> {
    catalogue().into_iter().find(|cause| cause.about().id == id)
}

/// Whether what a cause says of itself holds.
pub(super) fn holds(cause: &dyn Cause) -> Result<(), String> {
    let about = cause.about();
    if about.id.is_empty() || !about.id.chars().all(|c| c.is_ascii_lowercase() || c == '-') {
        return Err("ids are lower-case letters and hyphens".into());
    }
    let texts = [about.physics, about.resembles, about.next_measurement, about.source];
    if texts.iter().any(|text| text.trim().is_empty()) {
        return Err("`physics`, `resembles`, `next_measurement` and `source` are each a sentence".into());
    }
    if !about.class.contains(&about.id) {
        return Err("`class` names the cause itself as well".into());
    }
    for p in about.parameters {
        if !(p.low.is_finite() && p.high.is_finite() && p.low < p.high) || p.unit.is_empty() || p.meaning.is_empty() {
            return Err(format!("parameter `{}` has a unit, a meaning, and finite limits, the low one first", p.name));
        }
    }
    if about.parameters.is_empty() && !matches!(about.identifiable, Identifiable::No(_)) {
        return Err("what can be identified has a strength, its first parameter".into());
    }
    for values in cause.trials(&usual()) {
        if values.len() != about.parameters.len() {
            return Err(format!("trial {values:?} has {} values, wanted {}", values.len(), about.parameters.len()));
        }
        if let Err((name, found, low, high)) = within_limits(about, &values) {
            return Err(format!("trial {values:?}: `{name}` is {found}, wanted {low} to {high}"));
        }
        let mut effects = Effects::default();
        cause.add(&values, &mut effects);
        if format!("{effects:?}") == format!("{:?}", Effects::default()) {
            return Err(format!("trial {values:?} adds nothing"));
        }
    }
    Ok(())
}

/// A scene as in the paper.
fn usual() -> Scene {
    Scene {
        places: Vec::new(),
        frequency_hz: vec![46.3e3, 247.4e3, 580.8e3, 1051.2e3],
        quality_factor: vec![40.8, 193.2, 358.0, 503.8],
        interval_s: 2e-7,
        window_s: 1.4e-3,
        begin_s: 0.0,
        level_v: 0.87,
        input_level: 0.5,
        noise_v: 3.5e-4,
        residual_peaks_hz: vec![133e3, 92.6e3],
    }
}
