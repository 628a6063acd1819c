//! The stage `model.decay`.

mod along;
mod course;
mod systems;
mod tables;

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::course::{Parts, sidebands};
use self::systems::Systems;
use self::tables::{fit_array, hit_table, modes_with_lack, summary};
use super::count::Count;
use crate::artifacts::{Decays, shape_array};
use crate::events::DECAYS;
use crate::watched::watch;
use afmid_kernels::ringdown::{
    ChannelNoise, ChannelOptions, ChannelRingdown, Dropped, ModesWanted, Motion, follow_channels, follow_fitted,
};

/// Fits modes and mode shapes to free decays: one set of poles for all channels of all hits.
///
/// Model: y(k) = sum_j Re(rho_j exp(s_j k T)) + offset + slope k + n(k); poles shared, residues of each channel and hit
/// its own, noise of each channel white with wander. Of several hits the residues of a mode are one complex shape over
/// the channels times an amplitude per hit: tested, not imposed.
/// Method: maximum likelihood by variable projection; modes one by one, each kept if noise alone gains as much with a
/// probability below `false_alarm`. Lines that do not die away are left out. The first and the last part of the decays are
/// fitted too and their difference is tested. A mode that moves is fitted as one whose frequency and damping are functions
/// of its amplitude, of terms that the data choose (1, a, a^2, a^4, log a, 1/a), against as many exponentials as its line
/// needs: where the laws hold it is one row with the values at the smallest amplitude reached; where no law holds, the
/// last part counts.
/// Of several hits each is fitted by itself too, from the modes of all where those explain it: hits without a mode in
/// common are of unlike systems, and those of one of them (`system`) are fitted.
/// Shapes: `modes` by row, ascending; `shapes` over mode and channel with the modal assurance criterion over mode and
/// mode; `hits` a row per hit and mode; `course` rows of each mode, from both parts or along its amplitude; `systems` a
/// row per hit; `fit` over channel and time of the largest hit.
/// Units: Hz; shapes relative to the channel with the largest amplitude; amplitudes in the channels' units.
/// Accuracy: docs/results/decay.md. Standard errors count what the fit leaves round each mode (`lack_of_fit`).
/// Errors: no decay with 24 samples (shorter ones are left out with a warning); no oscillation.
/// Source: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; R. J. Allemang, D. L. Brown, Proc. 1st IMAC (1982)
/// 110.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DecayFit {
    /// Oscillating modes, 1 to 20, or `auto`: as many up to `max_modes` as the data show.
    pub modes: Count<20>,
    /// Largest number that `auto` tries. Why: each takes a fit.
    #[schemars(range(min = 1, max = 20))]
    pub max_modes: usize,
    /// Noise beside the ringing: `estimated` (white and wander, per channel) or `white`.
    pub noise: DecayNoise,
    /// Of which system the hits are fitted, where they are of several: 1 is that of most hits, `systems` lists them. Default
    /// 1. Why: hits of one structure are of one system, whatever it is hit with and where.
    #[schemars(range(min = 1))]
    pub system: usize,
    /// What counts of a mode that moves while it dies away: `auto`, its laws at the smallest amplitude or else its last
    /// part, or `whole`, one linear mode for all.
    pub part: FittedPart,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: ChannelOptions,
}

/// What counts where modes move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FittedPart {
    /// Laws of the amplitude, or else the last part of those modes.
    Auto,
    /// One linear mode for all of each decay.
    Whole,
}

/// Noise beside the ringing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecayNoise {
    /// White noise and wander of each channel.
    Estimated,
    /// White noise alone.
    White,
}

impl Default for DecayFit {
    fn default() -> Self {
        Self {
            modes: Count::Auto,
            max_modes: 12,
            noise: DecayNoise::Estimated,
            system: 1,
            part: FittedPart::Auto,
            fit: ChannelOptions::default(),
        }
    }
}

pub(super) const MODES: Port<Table> = Port::new("modes", "decay-modes", "modes, ascending");
pub(super) const SHAPES: Port<Array> =
    Port::new("shapes", "mode-shapes", "complex mode shapes over mode and channel, and how alike they are");
const HITS: Port<Table> = Port::new("hits", "decay-hits", "amplitude of each mode in each hit");
const COURSE: Port<Table> =
    Port::new("course", "decay-course", "modes of the first and the last part of the decays, or along their amplitude");
pub(super) const SYSTEMS: Port<Table> =
    Port::new("systems", "decay-systems", "strongest mode of each hit by itself, and its system");
const FIT: Port<Array> = Port::new("fit", "decay-fit", "the largest hit as measured, as fitted, and what is left");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "modes with damping and shapes, noise, what does not fit");

impl Stage for DecayFit {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.decay",
        version: 16,
        summary: "fits modes and mode shapes to free decays of several channels and hits",
        inputs: &[DECAYS.spec()],
        outputs: &[MODES.spec(), SHAPES.spec(), HITS.spec(), COURSE.spec(), SYSTEMS.spec(), FIT.spec(), SUMMARY.spec()],
        source: "G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let mut decays = long_enough(Decays::new(inputs.get(&DECAYS)?)?, cx)?;
        let systems = Systems::of(&decays, &self.options(cx));
        systems.choose(self.system, &mut decays)?;
        systems.warning(self.system).into_iter().for_each(|warning| cx.warn(warning));
        let decays = decays;
        let whole = self.part == FittedPart::Whole;
        let options = ChannelOptions { missing: decays.missing(), ..self.options(cx) };
        let motion = if whole { Motion::Whole } else { Motion::Laws };
        let interval_s = 1.0 / decays.sample_rate_hz;
        let followed = match systems.joint() {
            Some(all) => follow_fitted(all, &decays.hits, &decays.quiet, interval_s, &options, motion),
            None => follow_channels(&decays.hits, &decays.quiet, interval_s, &options, motion),
        };
        let mut followed = followed.map_err(StageError::from_error)?;
        followed.add_error_of_rate(decays.rate_error.relative_std);
        let parts = Parts::new(&followed, &decays, motion);
        let fit = &followed.fit;
        self.warn(fit, followed.fitted.poles.len(), &decays, cx);
        let companions = followed.dropped.iter().filter(|d| matches!(d.reason, Dropped::Companion { .. })).count();
        if companions > 0 {
            cx.warn(format!(
                "{companions} of the fitted exponentials are companions of modes that move with their amplitude and \
                 are left out: `summary` lists them under `dropped`"
            ));
        }
        sidebands(&followed).into_iter().for_each(|warning| cx.warn(warning));
        let channels: Vec<&str> = decays.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        parts.warnings().into_iter().for_each(|warning| cx.warn(warning));
        Ok(Ports::new()
            .with(&MODES, modes_with_lack(fit))
            .with(&SHAPES, shape_array(&fit.shapes.iter().collect::<Vec<_>>(), &channels))
            .with(&HITS, hit_table(&followed.whole, &decays))
            .with(&COURSE, parts.table())
            .with(&SYSTEMS, systems.table())
            .with(&FIT, fit_array(&followed, &decays))
            .with(&SUMMARY, summary(&followed, &parts, &systems, &decays)?))
    }

    fn examples() -> Vec<Example> {
        super::decay_example::examples()
    }
}

/// Samples of a decay that are fitted, at least: as the kernel wants them.
const LEAST_SAMPLES: usize = 24;

/// The decays without those that are too short to be fitted. Errors: none is left.
fn long_enough<'a>(mut decays: Decays<'a>, cx: &Context) -> Result<Decays<'a>, StageError> {
    let (all, longest) = (decays.hits.len(), decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0));
    let short = decays.leave_out_short(LEAST_SAMPLES);
    if decays.hits.is_empty() {
        let problem = format!(
            "none of {all} decays has {LEAST_SAMPLES} samples in every channel that are not clipped or missing: the \
             longest has {longest} in all"
        );
        return Err(StageError::new(problem).help("record at a higher rate, or hit less often"));
    }
    if !short.is_empty() {
        let named: Vec<String> = short.iter().take(MOST_NAMED).map(|number| (number + 1).to_string()).collect();
        let more = if short.len() > MOST_NAMED { ", ..." } else { "" };
        cx.warn(format!(
            "{} of {all} decays have fewer than {LEAST_SAMPLES} samples in a channel and are left out: hits {}{more}",
            short.len(),
            named.join(", ")
        ));
    }
    Ok(decays)
}

/// Hits that are named in a warning.
const MOST_NAMED: usize = 10;

impl DecayFit {
    fn options(&self, cx: &Context) -> ChannelOptions {
        ChannelOptions {
            modes: match self.modes {
                Count::Fixed(modes) => ModesWanted::Fixed(modes),
                Count::Auto => ModesWanted::AtMost(self.max_modes),
            },
            noise: match self.noise {
                DecayNoise::Estimated => ChannelNoise::Estimated,
                DecayNoise::White => ChannelNoise::White,
            },
            watch: watch(cx),
            ..self.fit.clone()
        }
    }

    /// Warns where something does not fit; `found`: exponentials that were fitted, of which some may be no modes.
    fn warn(&self, fit: &ChannelRingdown, found: usize, decays: &Decays<'_>, cx: &Context) {
        if let Count::Fixed(modes) = self.modes
            && fit.seen.iter().any(|tried| tried.modes == modes + 1)
        {
            cx.warn(format!(
                "{modes} {} wanted, and one more explains more than noise does: more may ring, or one moves; `modes = \
                 \"auto\"` takes as many as the data show",
                if modes == 1 { "mode is" } else { "modes are" }
            ));
        }
        if !fit.verdict.converged {
            cx.warn(format!(
                "no minimum after {} steps: the last was {:.2} standard errors",
                fit.verdict.steps, fit.verdict.distance
            ));
        }
        if self.modes == Count::Auto && found == self.max_modes {
            cx.warn(format!(
                "`modes = \"auto\"` fitted {found} exponentials, all that `max_modes` allows: there may be more modes, \
                 which a larger one in the config looks for"
            ));
        }
        let same = |channel: &usize| {
            let mut values = decays.hits.iter().filter_map(|hit| hit.get(*channel)).flat_map(|row| row.iter());
            let first = values.next();
            values.all(|value| Some(value) == first)
        };
        for sensor in (0..decays.sensors.len()).filter(same).filter_map(|channel| decays.sensors.get(channel)) {
            cx.warn(format!(
                "{} is the same number throughout: its zeros in the shapes say nothing, leave it out of `channels`",
                sensor.name
            ));
        }
        let lacking: Vec<String> = (1..)
            .zip(&fit.lack_of_fit)
            .filter(|(_, factor)| **factor > 1.0)
            .map(|(number, factor)| format!("{number} ({:.3})", factor.sqrt()))
            .collect();
        if !lacking.is_empty() {
            cx.warn(format!(
                "the fit leaves more than noise round modes {}: their standard errors are widened by the factors given",
                lacking.join(", ")
            ));
        }
        for found in fit.harmonics() {
            cx.warn(format!(
                "mode {} is weak, at {} times the frequency of mode {}, and dies as much faster: a harmonic, if what was \
                 measured is not linear",
                found.mode + 1,
                found.multiple,
                found.of + 1
            ));
        }
        for (number, mode) in fit.shapes.iter().enumerate().filter(|(_, shape)| !shape.rank_one.holds()) {
            cx.warn(format!(
                "mode {}: the {} hits do not share one shape over the {} channels (p = {:.1e}): a moving sensor, a \
                 nonlinear joint, or two modes that lie too close",
                number + 1,
                decays.hits.len(),
                decays.sensors.len(),
                mode.rank_one.p_value
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_fits_what_is_long_enough() {
        let noise = |k: usize| 1e-3 * ((k * k) as f64).sin();
        let ring = |n: usize| (0..n).map(|k| (-0.02 * k as f64).exp() * (0.4 * k as f64).sin() + noise(k)).collect();
        let follows = |samples: usize| {
            let (long, short): (Vec<f64>, Vec<f64>) = (ring(200), ring(samples));
            follow_channels(&[vec![&long[..]], vec![&short[..]]], &[], 1e-3, &ChannelOptions::default(), Motion::Laws)
        };
        assert!(follows(LEAST_SAMPLES).is_ok() && follows(LEAST_SAMPLES - 1).is_err());
    }

    /// A pendulum of 0.5 rad at a quality factor of 150: one row, the last of its course, whatever the rate's error.
    #[test]
    fn row_and_course_of_a_mode_that_moves_share_their_numbers() {
        let (w, interval_s) = (6.0, 0.03);
        let (mut x, mut v) = (0.5_f64, 0.0);
        let ring: Vec<f64> = (0..4000)
            .map(|k| {
                let now = x + 1e-3 * ((k * k) as f64).sin();
                for _ in 0..60 {
                    let step = interval_s / 60.0;
                    // the speed half a step ahead
                    v += step * (-w * w * x.sin() - w / 150.0 * v);
                    x += step * v;
                }
                now
            })
            .collect();
        let sensor = crate::at_hand::Named { name: "angle".to_owned(), unit: "rad".to_owned() };
        for relative_std in [0.0, 1e-3] {
            let decays = crate::at_hand::decays(&[vec![ring.clone()]], std::slice::from_ref(&sensor), 1.0 / interval_s);
            let decays = crate::artifacts::RateError { relative_std }.stated_by(decays.unwrap());
            let found = DecayFit::default().run(&Ports::new().with(&DECAYS, decays), &Context::alone(0)).unwrap();
            let (modes, course) = (found.get(&MODES).unwrap(), found.get(&COURSE).unwrap());
            assert_eq!((modes.rows(), course.rows()), (1, 12), "{modes:?}");
            assert!(course.text("part").unwrap().iter().all(|part| part == "along"));
            for name in ["frequency_hz", "frequency_std_hz", "damping_ratio", "damping_ratio_std"] {
                let (row, last) = (modes.real(name).unwrap()[0], course.real(name).unwrap()[11]);
                assert!((row / last - 1.0).abs() < 1e-6, "{name}: {row}, {last}");
            }
            // the last amplitude is a tenth of the first or less: the small angle's frequency less 1/16 of its square
            let (frequency, std) = (modes.real("frequency_hz").unwrap()[0], modes.real("frequency_std_hz").unwrap()[0]);
            let amplitude = course.real("amplitude").unwrap()[11];
            let truth = w / std::f64::consts::TAU * (1.0 - amplitude * amplitude / 16.0);
            assert!((frequency - truth).abs() < 5.0 * std + 1e-5 * truth, "{frequency}, {truth}, {std}");
            assert!(std > relative_std * truth);
        }
    }
}
