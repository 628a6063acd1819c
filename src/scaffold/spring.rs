//! The config of a spring constant: what no file says is asked for.

use afmid_pipeline::toml::{Table, Value};
use afmid_stages::calibration::ContactSpring;
use afmid_stages::io::length_m;

use super::choice::{Choice, Question, one_channel};
use super::first_file::FirstFile;
use super::lever::distance;
use super::pipeline::{Wanted, free_segment_samples};
use crate::cli::{Goal, SpringArgs};

/// Share of the sample rate below which a lever's first mode is not looked for: its segments resolve no peak there.
const LOWEST_SHARE: f64 = 1.0 / 500.0;
/// Share above which it is not, below half the rate by what a filter against aliases takes.
const HIGHEST_SHARE: f64 = 0.4;

/// Duration of the blocks that tell free stretches from contact: some periods of a lever's first mode.
const BLOCK_S: f64 = 1e-4;
/// Samples of a block that the stages take by themselves, for a rate of 5 MS/s.
const BLOCK_SAMPLES: f64 = 512.0;
/// Samples of a block at least.
const LEAST_BLOCK_SAMPLES: f64 = 16.0;

/// Errors: what is of a spring constant is said of something else.
pub fn is_wanted(wanted: &Wanted<'_>) -> Result<(), Question> {
    let said = match (wanted.spring.piezo, wanted.spring.contact) {
        _ if wanted.goal == Some(Goal::SpringConstant) => return Ok(()),
        (Some(_), _) => "--piezo",
        (None, Some(_)) => "--contact",
        (None, None) => return Ok(()),
    };
    let help = format!("wanted --goal spring-constant, or no {said}");
    Err((format!("{said}: only a spring constant needs it"), Some(help)))
}

/// Deflection and distance. Errors: no distance; what no file says and the user has not.
pub fn choice<'a>(file: &FirstFile<'a>, wanted: &Wanted<'_>) -> Result<Choice<'a>, Question> {
    let source = file.source;
    let chosen = one_channel(source, wanted, Goal::SpringConstant, String::new())?;
    let Some(piezo) = distance(source, chosen.channels[0]) else {
        let problem = format!("{} has no distance between lever and sample that moves", source.file.display());
        let help =
            "a spring constant needs the slope in contact: force curves with a channel named as piezo, height, z \
                    sensor or position; --goal thermal finds resonance and quality factor without"
                .to_owned();
        return Err((problem, Some(help)));
    };
    let is_length = length_m(piezo.unit.trim()).is_some();
    let mut missing = Vec::new();
    if !is_length && wanted.spring.piezo.is_none() {
        missing.push("--piezo M_PER_V: metres that the piezo travels a volt of its monitor, such as --piezo 25e-9");
    }
    if wanted.spring.contact.is_none() {
        missing.push(
            "--contact N_PER_M: stiffness of the contact, such as --contact 60, or --contact rigid where it is much stiffer \
             than the lever; one that gives way unknown makes the spring constant too low",
        );
    }
    if !missing.is_empty() {
        let problem = format!("{} does not say all that a spring constant needs", source.file.display());
        return Err((problem, Some(missing.join("; "))));
    }
    if is_length && wanted.spring.piezo.is_some() {
        let problem = format!("{} is in {} already", piezo.location, piezo.unit);
        return Err((problem, Some("leave --piezo out".to_owned())));
    }
    let why = format!(
        "the slope of {} against {} in contact, the noise in free stretches",
        chosen.channels[0].location, piezo.location
    );
    let exact = match wanted.spring.contact {
        Some(ContactSpring::NPerM(_)) => Some(
            "the contact's stiffness is taken as exact: `contact_stiffness_std_n_per_m` of the stage `stiffness` states its error",
        ),
        _ => None,
    };
    let notes = exact.into_iter().map(str::to_owned).collect();
    Ok(Choice { piezo: Some(piezo), free_stretches: true, why, notes, ..chosen })
}

/// The `params` of the sensitivity's stage; none where the piezo's channel is in a length.
pub fn sensitivity(choice: &Choice<'_>, spring: SpringArgs) -> String {
    let volts = choice.piezo.is_none_or(|piezo| length_m(piezo.unit.trim()).is_none());
    let travel = spring.piezo.filter(|_| volts).map(|travel| format!("piezo_m_per_v = {travel:e}"));
    let free = free(choice).map(|free| format!("free = {}", Value::Table(free)));
    let params: Vec<String> = travel.into_iter().chain(free).collect();
    if params.is_empty() { String::new() } else { format!("params = {{ {} }}\n", params.join(", ")) }
}

/// What a free stretch is at rates far from those of the default; none at others.
fn free(choice: &Choice<'_>) -> Option<Table> {
    let samples = (BLOCK_S * choice.channels[0].sample_rate_hz?).round().max(LEAST_BLOCK_SAMPLES);
    let is_far = !(0.5..=2.0).contains(&(samples / BLOCK_SAMPLES));
    is_far.then(|| Table::from_iter([("block_samples".to_owned(), Value::Integer(samples as i64))]))
}

/// The `params` of the spring constant's stage.
pub fn stiffness(choice: &Choice<'_>, spring: SpringArgs) -> String {
    let mut params = Table::new();
    let contact = spring.contact.map(|contact| match contact {
        ContactSpring::NPerM(stiffness) => Value::Float(stiffness),
        ContactSpring::Rigid => Value::String("rigid".to_owned()),
    });
    contact.into_iter().for_each(|contact| drop(params.insert("contact_stiffness_n_per_m".to_owned(), contact)));
    free(choice).into_iter().for_each(|free| drop(params.insert("free".to_owned(), Value::Table(free))));
    if let Some(rate) = choice.channels[0].sample_rate_hz {
        let mut peak = Table::new();
        let samples = i64::try_from(free_segment_samples(choice)).unwrap_or(i64::MAX);
        peak.insert("segment_samples".to_owned(), Value::Integer(samples));
        peak.insert("lowest_hz".to_owned(), Value::Float(rate * LOWEST_SHARE));
        peak.insert("highest_hz".to_owned(), Value::Float(rate * HIGHEST_SHARE));
        params.insert("peak".to_owned(), Value::Table(peak));
    }
    format!("params = {}\n", Value::Table(params))
}
