//! Hidden effects: an oscillator integrated in time with causes in it, diagnosed without a word about them.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::hidden_paths::{actuator, detector, through};
use super::verdict::{Diagnosis, Verdict};
use super::{DiagnosisOptions, Part, PartStart, Record, Stretch, diagnose};
use crate::causes::{Cause, built_in as find};
use crate::draws::few_or_all;
use crate::effects::{Effects, Instant, Intersample, Motion};

const SAMPLES: usize = 4096;
const RATE_HZ: f64 = 1000.0;
/// Fixed steps of the generator between samples: Runge-Kutta of fourth order, not the fit's integrator.
const STEPS: usize = 24;

/// A sum of sines with random phases: its samples, and itself between them.
struct Drive {
    lines: Vec<(f64, f64)>,
    scale: f64,
}

impl Drive {
    fn new(rng: &mut ChaCha8Rng, resonance_hz: f64) -> Self {
        let lines: Vec<(f64, f64)> = (1..=60)
            .map(|i| {
                (
                    resonance_hz * 0.05 * f64::from(i) * rng.random_range(0.99..1.01),
                    rng.random_range(0.0..std::f64::consts::TAU),
                )
            })
            .collect();
        Self { scale: 2.0 / (lines.len() as f64).sqrt(), lines }
    }

    fn at(&self, t: f64) -> f64 {
        self.lines.iter().map(|(f, phase)| (std::f64::consts::TAU * f * t + phase).sin()).sum::<f64>() * self.scale
    }
}

/// Input and output of an oscillator with the given causes, in volts.
fn simulated(seed: u64, hidden: &[(&str, Vec<f64>)], noise: f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let omega = [std::f64::consts::TAU * rng.random_range(60.0..90.0)];
    let quality: f64 = rng.random_range(6.0..20.0);
    let drive = Drive::new(&mut rng, omega[0] / std::f64::consts::TAU);
    let mut effects = Effects::default();
    for (id, values) in hidden {
        find(id).expect("a cause").add(values, &mut effects);
    }
    let sampled: Vec<f64> = (0..SAMPLES).map(|k| drive.at(k as f64 / RATE_HZ)).collect();
    let held = effects.intersample.unwrap_or_default() == Intersample::Held;
    let acceleration = |q: f64, v: f64, u: f64| {
        let motion = Motion { position: &[q], velocity: &[v], omega: &omega, gap: q, thermal: 0.0 };
        let mut a = [omega[0] * omega[0] * (0.5 * u - q) - omega[0] / quality * v];
        effects.modal_force.iter().for_each(|force| force.add(&motion, &mut a));
        a[0]
    };
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let (mut actuator, mut detector) = (actuator(hidden), detector(hidden));
    // the first value, which takes no time
    through(&mut actuator, sampled[0], 0.0, 0.0);
    let (mut q, mut v, mut output) = (0.0, 0.0, Vec::with_capacity(SAMPLES));
    for (k, u) in sampled.iter().enumerate() {
        let instant = Instant { record: 0, place: k as f64 / SAMPLES as f64, time_s: k as f64 / RATE_HZ, piezo_m: 0.0 };
        let white: f64 = StandardNormal.sample(&mut rng);
        let seen = through(&mut detector, q, instant.time_s, if k > 0 { h } else { 0.0 });
        output.push(seen + effects.added.iter().map(|added| added(&instant)).sum::<f64>() + noise * white);
        for i in 0..STEPS {
            let input =
                |part: f64| if held { *u } else { drive.at((k as f64 + (i as f64 + part) / STEPS as f64) / RATE_HZ) };
            let at_s = instant.time_s + i as f64 * h;
            if i > 0 {
                through(&mut detector, q, at_s, h);
            }
            let [u0, u1, u2] = [(0.0, 0.0), (0.5, 0.5 * h), (1.0, 0.5 * h)]
                .map(|(part, since_s)| through(&mut actuator, input(part), at_s + part * h, since_s));
            let (a1, v1) = (acceleration(q, v, u0), v);
            let (v2, a2) = (v + 0.5 * h * a1, acceleration(q + 0.5 * h * v1, v + 0.5 * h * a1, u1));
            let (v3, a3) = (v + 0.5 * h * a2, acceleration(q + 0.5 * h * v2, v + 0.5 * h * a2, u1));
            let (v4, a4) = (v + h * a3, acceleration(q + h * v3, v + h * a3, u2));
            q += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
    }
    (sampled, output)
}

/// Values of a cause that change the output of oscillator `seed` by some per cent; it swings over 2 to 4 V.
fn drawn(id: &str, seed: u64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let size: f64 = 10f64.powf(rng.random_range(0.0..0.7));
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    match id {
        "duffing" => vec![3e-3 * size],
        "quadratic-stiffness" => vec![6e-3 * size * sign],
        "quintic-stiffness" => vec![4e-4 * size],
        "quadratic-damping" => vec![4e-3 * size],
        "nonlinear-damping" => vec![3e-3 * size],
        "coulomb-friction" => vec![6e-3 * size],
        "output-quadratic" => vec![3e-3 * size * sign],
        "output-cubic" => vec![1.5e-3 * size * sign],
        "output-absolute" => vec![5e-3 * size * sign],
        "output-saturation" => vec![0.06 * size, rng.random_range(0.8..1.3)],
        "input-saturation" => vec![0.06 * size, rng.random_range(1.0..2.0)],
        "input-dead-zone" => vec![0.1 * size, rng.random_range(0.3..0.8)],
        "intersample" => vec![2.0],
        "offset" => vec![0.01 * size * sign],
        "baseline-drift" => vec![0.01 * size * sign, 0.004 * size, 0.0],
        "dead-band" => vec![0.05 * size, rng.random_range(0.2..0.6)],
        "gain-step" => vec![6e-3 * size * sign, rng.random_range(0.6..3.5)],
        "slew-rate" => {
            let (_, output) = simulated(seed, &[], 0.0);
            let fastest = output.windows(2).fold(0.0, |most: f64, pair| most.max((pair[1] - pair[0]).abs() * RATE_HZ));
            vec![1.0 / (fastest * (0.85 - 0.07 * size))]
        }
        "backlash" => vec![0.01 * size],
        "creep" => vec![0.01 * size, 10f64.powf(rng.random_range(-2.5..-1.0))],
        "spurious-line" => vec![5e-3 * size, rng.random_range(100.0..400.0), 0.7],
        other => panic!("no strength for {other}"),
    }
}

const IDS: [&str; 21] = [
    "duffing",
    "quadratic-stiffness",
    "quintic-stiffness",
    "quadratic-damping",
    "nonlinear-damping",
    "coulomb-friction",
    "output-quadratic",
    "output-cubic",
    "output-absolute",
    "output-saturation",
    "input-saturation",
    "input-dead-zone",
    "intersample",
    "offset",
    "baseline-drift",
    "spurious-line",
    "dead-band",
    "gain-step",
    "slew-rate",
    "backlash",
    "creep",
];
/// Noise of the output, V.
const NOISE: f64 = 5e-3;

fn diagnosed(seed: u64, hidden: &[(&str, Vec<f64>)], without: &[&str]) -> Diagnosis {
    within(DiagnosisOptions::default().work, seed, hidden, without)
}

/// The same with a limit of work.
fn within(work: u64, seed: u64, hidden: &[(&str, Vec<f64>)], without: &[&str]) -> Diagnosis {
    let (input, output) = simulated(seed, hidden, NOISE);
    let candidates: Vec<&'static dyn Cause> =
        IDS.iter().filter(|id| !without.contains(id)).filter_map(|id| find(id)).collect();
    let training = vec![Stretch { record: 0, first: 0, end: SAMPLES }];
    let options = DiagnosisOptions { training, candidates, work, ..DiagnosisOptions::default() };
    let record = Record { input: &input, outputs: vec![&output] };
    diagnose(&[record], 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<String> {
    diagnosis.causes.iter().map(|cause| cause.id.clone()).collect()
}

/// Rounds of all causes: one, or two in `make accuracy`; `AFMID_ROUNDS` raises it for the figures of
/// docs/results/input-output.md.
fn rounds() -> u64 {
    std::env::var("AFMID_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(few_or_all(1, 2))
}

#[test]
fn what_was_not_tried_at_the_limit_of_work_is_said_and_nothing_is_named() {
    for seed in 0..2 {
        let hidden = [("duffing", vec![4e-3]), ("output-quadratic", vec![3e-3])];
        let whole = diagnosed(seed, &hidden, &[]);
        assert_eq!((whole.verdict, names(&whole).len()), (Verdict::Named, 2), "{seed}: {whole:?}");
        // no work at all; enough for some
        for work in [0, 3_000_000] {
            let cut = within(work, seed, &hidden, &[]);
            let said = cut.evidence.iter().filter(|line| line.contains("came to its limit of work")).count();
            assert_eq!((cut.verdict, names(&cut).len(), said), (Verdict::Unexplained, 0, 1), "{seed} {work}: {cut:?}");
        }
    }
}

#[test]
fn one_hidden_cause_is_named_with_its_parameters() {
    let jobs: Vec<(u64, &str)> = (0..rounds())
        .flat_map(|round| IDS.iter().enumerate().map(move |(i, id)| (1000 * round + i as u64, *id)))
        .collect();
    let results: Vec<(bool, usize, usize)> = jobs
        .par_iter()
        .map(|(seed, id)| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed + 77);
            let values = drawn(id, *seed, &mut rng);
            let diagnosis = diagnosed(*seed, &[(id, values.clone())], &[]);
            let right = diagnosis.verdict == Verdict::Named && names(&diagnosis) == [*id];
            let about = find(id).expect("a cause").about();
            let (mut inside, mut all) = (0, 0);
            if right {
                for (parameter, truth) in about.parameters.iter().zip(&values) {
                    let found = &diagnosis.causes[0].parameters[parameter.name];
                    let (Some(value), Some(std)) = (found.value, found.std) else { continue };
                    all += 1;
                    // a line's phase counts in full turns, its sign in half ones
                    let line = *id == "spurious-line";
                    let off = if line && parameter.name == "amplitude" { value.abs() - truth } else { value - truth };
                    let off = if line && parameter.unit == "rad" { (2.0 * off).sin() / 2.0 } else { off };
                    inside += usize::from(off.abs() < 3.0 * std);
                    if off.abs() >= 3.0 * std {
                        println!("{id} {seed}: {} {value:.5} +- {std:.5}, truth {truth:.5}", parameter.name);
                    }
                }
            } else {
                println!(
                    "{id} {values:?} {seed}: {:?} {:?} {:?}",
                    diagnosis.verdict,
                    names(&diagnosis),
                    diagnosis.evidence
                );
            }
            (right, inside, all)
        })
        .collect();
    let right = results.iter().filter(|result| result.0).count();
    let (inside, all) = results.iter().fold((0, 0), |(a, b), result| (a + result.1, b + result.2));
    println!("single: {right} of {} named, {inside} of {all} parameters within 3 standard errors", results.len());
    // 97 % named are the aim; two more may miss in so short a run
    assert!(right as f64 >= 0.97 * results.len() as f64 - 2.0);
    assert!(inside as f64 >= 0.97 * all as f64 - 2.0);
}

#[test]
fn two_hidden_causes_are_both_named() {
    let count = rounds() * few_or_all(6, 10);
    let results: Vec<bool> = (0..count)
        .into_par_iter()
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed + 4242);
            let first = rng.random_range(0..IDS.len());
            let second = (first + rng.random_range(1..IDS.len())) % IDS.len();
            let hidden = [first, second].map(|i| (IDS[i], drawn(IDS[i], seed + 5000, &mut rng)));
            let diagnosis = diagnosed(seed + 5000, &hidden, &[]);
            let mut found = names(&diagnosis);
            let mut truth = hidden.clone().map(|(id, _)| id.to_owned()).to_vec();
            found.sort();
            truth.sort();
            if found != truth {
                println!("{hidden:?}: {:?} {found:?} {:?}", diagnosis.verdict, diagnosis.evidence);
            }
            found == truth
        })
        .collect();
    let right = results.iter().filter(|right| **right).count();
    println!("pairs: {right} of {count} fully named");
    // 90 % are the aim, docs/results/input-output.md has what is reached; a quarter may miss
    assert!(right as f64 >= 0.75 * count as f64 - 1.0);
}

/// A drift is learnt over three quarters of a record; what it is in the last one follows from there, and does not begin
/// again.
#[test]
fn a_drift_goes_on_where_it_was_not_learnt() {
    for seed in 0..4 {
        let (input, output) = simulated(40_000 + seed, &[("baseline-drift", vec![0.2, 0.03, 0.0])], NOISE);
        let cut = SAMPLES / 4 * 3;
        let held = Stretch { record: 0, first: cut, end: SAMPLES };
        let part = Part { name: "held".to_owned(), stretch: held, start: PartStart::FirstSamples(100) };
        let candidates: Vec<&'static dyn Cause> = IDS.iter().filter_map(|id| find(id)).collect();
        let training = vec![Stretch { record: 0, first: 0, end: cut }];
        let options = DiagnosisOptions { training, candidates, parts: vec![part], ..DiagnosisOptions::default() };
        let record = Record { input: &input, outputs: vec![&output] };
        let found = diagnose(&[record], 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis;
        assert!(
            names(&found).contains(&"baseline-drift".to_owned()),
            "{seed}: {:?} {:?}",
            names(&found),
            found.evidence
        );
        let errors = &found.validation[0];
        let (before, after) = (errors.rms_before.unwrap_or(f64::NAN), errors.rms_after.unwrap_or(f64::NAN));
        // the drift is 0.2 to 0.3 V there, noise a fortieth of that
        assert!(after < 0.2 * before, "{seed}: {before} {after}");
    }
}

#[test]
fn nothing_hidden_is_clean() {
    let count = rounds() * few_or_all(10, 20);
    let alarms: Vec<u64> = (0..count)
        .into_par_iter()
        .filter(|seed| {
            let diagnosis = diagnosed(seed + 9000, &[], &[]);
            if diagnosis.verdict != Verdict::Clean {
                println!("{seed}: {:?} {:?} {:?}", diagnosis.verdict, names(&diagnosis), diagnosis.evidence);
            }
            diagnosis.verdict != Verdict::Clean
        })
        .collect();
    println!("clean: {} false alarms of {count}", alarms.len());
    // at 1 % more than 3 of 40 have a probability of 1e-3, more than one of ten of 4e-3
    assert!(alarms.len() as f64 <= few_or_all(1.0, 3.0) + 0.01 * count as f64);
}

#[test]
fn a_cause_left_out_of_the_catalogue_is_unexplained() {
    // ten times the strengths that are named
    let left_out: [(&str, Vec<f64>, &[&str]); 5] = [
        ("duffing", vec![0.08], &["duffing"]),
        ("quadratic-stiffness", vec![0.1], &["quadratic-stiffness"]),
        ("output-absolute", vec![0.15], &["output-absolute"]),
        ("output-saturation", vec![0.9, 0.8], &["output-saturation"]),
        ("intersample", vec![2.0], &["intersample"]),
    ];
    let count = rounds();
    let kinds = few_or_all(3, left_out.len());
    let jobs: Vec<(u64, usize)> = (0..count).flat_map(|seed| (0..kinds).map(move |i| (seed, i))).collect();
    let results: Vec<bool> = jobs
        .par_iter()
        .map(|(seed, i)| {
            let (id, values, without) = &left_out[*i];
            let diagnosis = diagnosed(seed + 20_000, &[(id, values.clone())], without);
            if diagnosis.verdict != Verdict::Unexplained {
                println!(
                    "{id} left out, {seed}: {:?} {:?} {:?}",
                    diagnosis.verdict,
                    names(&diagnosis),
                    diagnosis.evidence
                );
            }
            diagnosis.verdict == Verdict::Unexplained
        })
        .collect();
    let right = results.iter().filter(|right| **right).count();
    println!("left out: {right} of {} unexplained", results.len());
    // nine of ten are wanted; one more may miss, of ten two
    assert!(right as f64 >= 0.9 * results.len() as f64 - few_or_all(1.0, 2.0));
}

#[test]
fn a_law_without_a_name_is_said() {
    // some per cent of the output, as causes are named at; the words are those of the law that was hidden
    let laws: [(&str, f64, &str); 3] = [
        ("duffing", 0.02, "deflection^3 of mode 1"),
        ("quadratic-stiffness", 0.03, "deflection^2 of mode 1"),
        ("nonlinear-damping", 0.02, "deflection^2 of mode 1 times rate of mode 1"),
    ];
    let jobs: Vec<(u64, usize)> =
        (0..few_or_all(1, 4)).flat_map(|seed| (0..laws.len()).map(move |i| (seed, i))).collect();
    let results: Vec<(bool, bool)> = jobs
        .par_iter()
        .map(|(seed, i)| {
            let (id, strength, words) = laws[*i];
            let diagnosis = diagnosed(seed + 30_000, &[(id, vec![strength])], &[id]);
            let said = format!("a force on mode 1 by {words} ");
            let is_said = diagnosis.evidence.iter().any(|line| line.starts_with(&said));
            println!("{id}, {seed}: {:?} {:?} {:?}", diagnosis.verdict, names(&diagnosis), diagnosis.evidence.last());
            (diagnosis.verdict == Verdict::Unexplained, is_said)
        })
        .collect();
    let unexplained = results.iter().filter(|(unexplained, _)| *unexplained).count();
    let said = results.iter().filter(|(_, said)| *said).count();
    println!("left out at the strength of names: {unexplained} of {} unexplained, the law said in {said}", jobs.len());
    // all twelve are reached; one of each may miss
    assert!(unexplained + 1 >= jobs.len() && said + 1 >= jobs.len());
}
