//! An archive's recipe from a seed.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::levers::lever;
use super::limits::{Count, Limits, limit};
use crate::causes::{About, Cause, Identifiable, Parameter, Scene, releases_have};
use crate::diagnosis::ReleaseDiagnose;
use crate::simulate::{Afm, Hidden};

/// What is hidden in an archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Nothing.
    Clean,
    /// One cause.
    One,
    /// Two or three of different classes.
    Mixture,
    /// One that the diagnosis may not use.
    LeftOut,
}

/// A hidden cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planted {
    /// Its id.
    pub id: String,
    /// What it can't be distinguished from.
    pub class: Vec<String>,
    /// Its parameters' names and values; the first is the main one.
    pub parameters: Vec<(String, f64)>,
    /// Strength at which the expected gain is [`super::LIMIT_GAIN`], beside what else is hidden; infinite if none is.
    pub limit: f64,
}

impl Planted {
    /// Strength over the limit.
    pub fn times_limit(&self) -> f64 {
        self.parameters.first().map_or(0.0, |(_, value)| value.abs() / self.limit)
    }
}

/// An archive's recipe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Draw {
    /// Where everything comes from.
    pub seed: u64,
    /// What is hidden.
    pub kind: Kind,
    /// The hidden causes.
    pub planted: Vec<Planted>,
    /// Ids that the diagnosis may not use.
    pub without: Vec<String>,
    /// Nominal detector poles that the diagnosis begins with, up to 15 % off, Hz.
    pub nominal_poles_hz: Vec<f64>,
    /// The simulation.
    pub afm: Afm,
}

/// Strengths reach from the limit to this many times.
const STRONGEST: f64 = 30.0;
/// A left-out cause has this strength at least: the verdict must say that something is wrong.
const LEFT_OUT: f64 = 10.0;
/// Nominal poles are off by up to this share.
const POLES_OFF: f64 = 0.15;
/// Records of an archive whose records hold several cycles.
const LONG_RECORDS: usize = 6;
/// Part of a short record in which its release falls, of its length.
const RELEASED: (f64, f64) = (0.3, 0.6);
/// Cycle position at which a record without release begins: far above the surface.
const IDLE: f64 = 0.02;
/// Periods of a line that a record must hold: fewer have no neighbouring frequencies to be compared with.
const LEAST_PERIODS: f64 = 5.0;
/// Part of a parameter's limit that a strength may reach: at the limit itself no fit may say what it is.
const ROOM: f64 = 0.8;
/// Attempts to find a cause whose limit lies within its parameter's limits.
const ATTEMPTS: usize = 40;

/// Draws an archive: lever, records, scatter, causes and strengths.
///
/// # Method
/// Kinds in the shares 25 % clean, 45 % one, 15 % mixtures, 15 % left out, unless given. Causes of equal chance among
/// those of `catalogue` that act on releases and can be named; further parameters from one of the cause's own trials,
/// up to 25 % off; strength log-uniform from the limit to 30 times (a left-out cause from 10 times). Records are parts
/// of a cycle with one release or none; one archive in ten has records of several cycles.
///
/// # Errors
/// None: nothing if the catalogue holds no such cause.
pub fn draw(seed: u64, kind: Option<Kind>, catalogue: &[&'static dyn Cause]) -> Option<Draw> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let kind = kind.unwrap_or_else(|| match rng.random_range(0..20) {
        0..5 => Kind::Clean,
        5..14 => Kind::One,
        14..17 => Kind::Mixture,
        _ => Kind::LeftOut,
    });
    let (mut afm, releases) = archive(seed, &mut rng);
    let wanted = match kind {
        Kind::Clean => 0,
        Kind::One | Kind::LeftOut => 1,
        Kind::Mixture => rng.random_range(2..4),
    };
    let planted = plant(wanted, kind, &afm, releases, catalogue, &mut rng)?;
    afm.hidden = planted.iter().map(|(cause, values, _)| Hidden::new(cause.about(), values)).collect();
    let without = match kind {
        Kind::LeftOut => planted.iter().flat_map(|(cause, ..)| class(*cause)).collect(),
        _ => Vec::new(),
    };
    let off = |pole: &f64| pole * (1.0 + POLES_OFF * (2.0 * rng.random::<f64>() - 1.0));
    Some(Draw {
        seed,
        kind,
        without,
        nominal_poles_hz: afm.detector_poles_hz.iter().map(off).collect(),
        planted: planted.into_iter().map(|(cause, values, limit)| described(cause, &values, limit)).collect(),
        afm,
    })
}

fn class(cause: &dyn Cause) -> Vec<String> {
    cause.about().class.iter().map(|id| (*id).to_owned()).collect()
}

fn described(cause: &dyn Cause, values: &[f64], limit: f64) -> Planted {
    let about = cause.about();
    let named = about.parameters.iter().zip(values);
    Planted {
        id: about.id.to_owned(),
        class: class(cause),
        parameters: named.map(|(parameter, value)| (parameter.name.to_owned(), *value)).collect(),
        limit,
    }
}

/// The microscope and the number of its releases.
fn archive(seed: u64, rng: &mut ChaCha8Rng) -> (Afm, usize) {
    let lever = lever(rng);
    let short = rng.random_range(10..=16);
    let scatter = 0.06 * 4.9f64.powf(rng.random::<f64>());
    let idle = rng.random_range(0..=2);
    let long = rng.random_range(0..10) == 0;
    let records = if long { LONG_RECORDS } else { short };
    let base = Afm::default();
    // the weakest release must survive the catch: a gap that half of it closes
    let weakest_n = base.adhesion_n * (1.0 - 3.0 * scatter);
    let afm = Afm {
        records,
        // 40 ms of a cycle of 0.36 s, or a cycle and a half
        samples: if long { 2_700_000 } else { 200_000 },
        // room for the strongest releases, at the paper's 2.2 um/s
        ramp_m: 400e-9,
        ramp_hz: 2.79,
        surface_m: -100e-9,
        snap_in_gap_m: (0.5 * weakest_n / base.contact_stiffness_n_per_m).min(base.snap_in_gap_m),
        adhesion_scatter: scatter.min(0.29),
        frequencies_hz: lever.frequencies_hz,
        quality_factors: lever.quality_factors,
        tip_shares: lever.tip_shares,
        detector_shares: lever.detector_shares,
        // as a diagnosis takes it where nothing else is said
        piezo_m_per_v: ReleaseDiagnose::default().piezo_m_per_unit,
        // one bit more at the same step: what a cause adds must not clip, which would be a cause of its own
        adc_bits: base.adc_bits + 1,
        compression: 0,
        seed: Some(seed),
        ..base.clone()
    };
    let afm = if long { afm } else { with_phases(afm, idle, rng) };
    // at least one full cycle in a long record
    (afm, if long { records } else { records - idle })
}

/// Every record but the last `idle` ones around a release, which comes somewhere in its middle (adhesion that scatters
/// may move it further, even out of the record); those are free all the time.
fn with_phases(afm: Afm, idle: usize, rng: &mut ChaCha8Rng) -> Afm {
    let height_m = afm.surface_m + afm.adhesion_n * (1.0 / afm.stiffness_n_per_m + 1.0 / afm.contact_stiffness_n_per_m);
    // cycle position of the release on the way up, and the cycles of a record
    let (release, cycles) = (0.75 + 0.5 * height_m / afm.ramp_m, afm.samples as f64 / afm.sample_rate_hz * afm.ramp_hz);
    let phase = |record: usize| {
        let before = RELEASED.0 + (RELEASED.1 - RELEASED.0) * rng.random::<f64>();
        if record + idle < afm.records { (release - before * cycles).rem_euclid(1.0) } else { IDLE }
    };
    let phases = (0..afm.records).map(phase).collect();
    Afm { phases: Some(phases), ..afm }
}

type Chosen = (&'static dyn Cause, Vec<f64>, f64);

fn plant(
    wanted: usize,
    kind: Kind,
    afm: &Afm,
    releases: usize,
    catalogue: &[&'static dyn Cause],
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Chosen>> {
    let mut planted: Vec<Chosen> = Vec::new();
    if wanted == 0 {
        return Some(planted);
    }
    let count = Count { events: releases, records: afm.records };
    let beside = |others| Limits::new(&afm.microscope(), count, afm.samples, afm.surface_m, others);
    let limits = beside(Vec::new())?;
    let candidates: Vec<&'static dyn Cause> = catalogue.iter().copied().filter(|cause| nameable(*cause)).collect();
    for _ in 0..ATTEMPTS {
        if planted.len() == wanted || candidates.is_empty() {
            break;
        }
        let cause = candidates[rng.random_range(0..candidates.len())];
        let about = cause.about();
        let taken = planted.iter().any(|(other, ..)| other.about().class.contains(&about.id));
        let trials = cause.trials(&scene(afm, rng));
        if taken || trials.is_empty() {
            continue;
        }
        let mut values = trials[rng.random_range(0..trials.len())].clone();
        // a line stands where it stands: at the mains, or far enough from the modes
        let moves = |parameter: &Parameter| parameter.name != "frequency_hz" || cause.free_in_each_record() == 0;
        for (value, parameter) in values.iter_mut().zip(about.parameters).skip(1).filter(|(_, p)| moves(p)) {
            *value = (*value * (0.8 + 0.45 * rng.random::<f64>())).clamp(parameter.low, parameter.high);
        }
        let signed = about.parameters.first().is_some_and(|parameter| parameter.low < 0.0);
        let turned = signed && rng.random::<bool>();
        // of a line whose phase is another in every record the sign means nothing, and no one could state it
        if turned && cause.free_in_each_record() == 0 {
            values[0] = -values[0];
        }
        if cause.free_in_each_record() > 0 && periods(about, &values, afm) < LEAST_PERIODS {
            continue;
        }
        let Some(limit) = limit(&limits, cause, &values) else { continue };
        let weakest = if kind == Kind::LeftOut { LEFT_OUT } else { 1.0 };
        let times = weakest * (STRONGEST / weakest).powf(rng.random::<f64>());
        let highest = ROOM * about.parameters.first().map_or(0.0, |p| if values[0] < 0.0 { -p.low } else { p.high });
        if weakest * limit > highest {
            continue;
        }
        values[0] = values[0].signum() * (times * limit).min(highest);
        planted.push((cause, values, limit));
    }
    (planted.len() == wanted).then(|| {
        let with_limit = |(i, (cause, values, alone)): (usize, &Chosen)| {
            let others: Vec<_> =
                (0..wanted).filter(|j| *j != i).map(|j| (planted[j].0, planted[j].1.clone())).collect();
            let own =
                if others.is_empty() { Some(*alone) } else { beside(others).and_then(|l| limit(&l, *cause, values)) };
            // beside the others it may not show at any strength
            (*cause, values.clone(), own.unwrap_or(f64::INFINITY))
        };
        planted.iter().enumerate().map(with_limit).collect()
    })
}

/// Periods of a line in a record.
fn periods(about: &About, values: &[f64], afm: &Afm) -> f64 {
    let frequency_hz = about.parameters.iter().zip(values).find(|(parameter, _)| parameter.name == "frequency_hz");
    frequency_hz.map_or(f64::INFINITY, |(_, f)| f * afm.samples as f64 / afm.sample_rate_hz)
}

fn nameable(cause: &dyn Cause) -> bool {
    let about = cause.about();
    // a level at which a signal is cut is no strength: less of it shows more
    let has_a_strength = about.id != "clipping";
    has_a_strength && about.is_met(releases_have) && !matches!(about.identifiable, Identifiable::No(_))
}

/// What trial values come from: the truth, and a frequency where nothing rings yet.
fn scene(afm: &Afm, rng: &mut ChaCha8Rng) -> Scene {
    let first = afm.frequencies_hz.iter().copied().fold(f64::INFINITY, f64::min);
    let last = afm.frequencies_hz.iter().copied().fold(0.0, f64::max);
    let free = (0..ATTEMPTS).map(|_| first * (last / first).powf(rng.random::<f64>())).find(|f| {
        // no nearer than 6 % to any mode: two lines of one resonance are another cause
        afm.frequencies_hz.iter().all(|mode| (f / mode - 1.0).abs() > 0.06)
    });
    Scene {
        frequency_hz: afm.frequencies_hz.clone(),
        quality_factor: afm.quality_factors.clone(),
        interval_s: 1.0 / afm.sample_rate_hz,
        window_s: 8000.0 / afm.sample_rate_hz,
        begin_s: 0.0,
        level_v: afm.adhesion_n / afm.stiffness_n_per_m * afm.sensitivity_v_per_m,
        input_level: 0.0,
        noise_v: afm.white_v / (afm.records as f64).sqrt(),
        residual_peaks_hz: free.into_iter().collect(),
        places: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::CATALOGUE;

    #[test]
    fn every_draw_is_a_valid_simulation_and_the_same_again() {
        for seed in 0..5 {
            let one = draw(seed, None, CATALOGUE).unwrap();
            assert_eq!(one, draw(seed, None, CATALOGUE).unwrap());
            afmid_pipeline::stage::check(&one.afm).unwrap();
            assert_eq!(one.planted.len(), one.afm.hidden.len());
            for planted in &one.planted {
                // beside others a limit is another one
                let most = if one.kind == Kind::Mixture { f64::INFINITY } else { 1.0001 * STRONGEST };
                assert!((0.0..=most).contains(&planted.times_limit()), "{planted:?}");
            }
            for (nominal, pole) in one.nominal_poles_hz.iter().zip(&one.afm.detector_poles_hz) {
                assert!((nominal / pole - 1.0).abs() <= POLES_OFF);
            }
        }
    }

    #[test]
    fn a_left_out_cause_is_left_out_with_its_class() {
        let draw = draw(3, Some(Kind::LeftOut), CATALOGUE).unwrap();
        assert!(draw.without.contains(&draw.planted[0].id));
        assert!(draw.planted[0].class.iter().all(|id| draw.without.contains(id)));
    }
}
