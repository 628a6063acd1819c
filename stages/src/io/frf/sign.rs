//! The sign of the imaginary parts of the responses of files.

use std::path::{Path, PathBuf};

use afmid_kernels::c64;
use afmid_kernels::phase_sign::{SignCounts, sign_counts};
use afmid_pipeline::StageError;
use afmid_pipeline::recording::FileResponse;
use rayon::prelude::*;

use super::stage::PhaseSign;

/// Resonances of one sign to one of the other, at least, for a file to be of that sign.
const LEAST_RATIO: usize = 4;
/// Names that are listed; more are counted.
const MOST_NAMES: usize = 5;

/// What was found of a file whose resonances are of `exp(-i w t)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OtherSign {
    /// The imaginary parts are turned.
    Turned,
    /// They are ratios of two motions, and as the file has them.
    Ratio,
}

/// Turns the imaginary parts of a file's responses where they are of `exp(-i w t)`, all or none. Errors: responses of
/// both signs.
pub(super) fn settle(
    path: &Path,
    responses: &mut [FileResponse],
    wanted: PhaseSign,
) -> Result<Option<OtherSign>, StageError> {
    match wanted {
        PhaseSign::AsStored => Ok(None),
        PhaseSign::Turned => {
            turn(responses);
            Ok(None)
        }
        PhaseSign::Auto => by_resonances(path, responses),
    }
}

fn turn(responses: &mut [FileResponse]) {
    responses.iter_mut().flat_map(|response| &mut response.values).for_each(|value| value.im = -value.im);
}

fn by_resonances(path: &Path, responses: &mut [FileResponse]) -> Result<Option<OtherSign>, StageError> {
    let count = |response: &FileResponse| {
        let values: Vec<c64> = response.values.iter().map(|h| c64::new(h.re, h.im)).collect();
        sign_counts(&response.frequency_hz, &values)
    };
    let counts: Vec<SignCounts> = responses.par_iter().map(count).collect();
    let named = |is: fn(&SignCounts) -> bool| -> Vec<String> {
        let of = responses.iter().zip(&counts).filter(|(_, counts)| is(counts));
        of.map(|(response, _)| response.location.clone()).collect()
    };
    // noise that is smoothed shows the other sign now and then: the file as a whole decides
    let total = |of: fn(&SignCounts) -> usize| counts.iter().map(of).sum::<usize>();
    let (all_positive, all_negative) = (total(|of| of.positive), total(|of| of.negative));
    if all_negative == 0 || all_positive >= LEAST_RATIO * all_negative {
        return Ok(None);
    }
    let negative = named(|of| of.negative > of.positive);
    let positive = named(|of| of.positive > of.negative);
    if responses.iter().any(|response| is_ratio(&response.unit)) {
        return Ok(Some(OtherSign::Ratio));
    }
    if all_negative < LEAST_RATIO * all_positive && !positive.is_empty() && !negative.is_empty() {
        return Err(both(&negative, &positive, path));
    }
    if all_negative < LEAST_RATIO * all_positive {
        return Ok(None);
    }
    turn(responses);
    Ok(Some(OtherSign::Turned))
}

/// Whether a unit is that of output and input alike.
fn is_ratio(unit: &str) -> bool {
    let output = unit.get(..unit.len() / 2).unwrap_or_default();
    unit == "1" || !output.is_empty() && unit == format!("{output}/{output}")
}

fn both(negative: &[String], positive: &[String], path: &Path) -> StageError {
    StageError::new(format!(
        "the imaginary parts of {} are of exp(-i w t), those of {} of exp(+i w t): wanted one sign in a file",
        some_of(negative),
        some_of(positive)
    ))
    .help("correct the sign in the file, or read all as they are with `--set <this stage>.phase=as-stored`")
    .at(path)
}

/// What the user should know of the signs in these files.
pub(super) fn remarks(paths: &[PathBuf], found: &[Option<OtherSign>]) -> Vec<String> {
    let files = |wanted: OtherSign| -> Vec<String> {
        let of = paths.iter().zip(found).filter(|(_, found)| **found == Some(wanted));
        of.map(|(path, _)| path.file_name().unwrap_or_default().to_string_lossy().into_owned()).collect()
    };
    let turned = files(OtherSign::Turned);
    let turned = (!turned.is_empty()).then(|| {
        format!(
            "{}: the phases have the other sign, exp(-i w t), with which no resonance decays: the imaginary parts are \
             turned; `phase = \"as-stored\"` leaves them",
            some_of(&turned)
        )
    });
    let ratios = files(OtherSign::Ratio);
    let ratios = (!ratios.is_empty()).then(|| {
        format!(
            "{}: the phases look like the other sign, exp(-i w t), as those of a ratio of two motions may: nothing is \
             turned; `phase = \"turned\"` turns the imaginary parts",
            some_of(&ratios)
        )
    });
    turned.into_iter().chain(ratios).collect()
}

fn some_of(names: &[String]) -> String {
    let more = if names.len() > MOST_NAMES { format!(" and {} more", names.len() - MOST_NAMES) } else { String::new() };
    names.iter().take(MOST_NAMES).cloned().collect::<Vec<String>>().join(", ") + &more
}
