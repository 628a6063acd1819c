//! The stage `model.decay`.

mod course;
mod tables;

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::course::{Course, Followed, follow};
use self::tables::{fit_array, hit_table, summary};
use super::count::Count;
use crate::artifacts::{Decays, damped_mode_table, shape_array};
use crate::events::DECAYS;
use afmid_kernels::ringdown::{ChannelNoise, ChannelOptions, ChannelRingdown, ModesWanted};

/// Fits modes and mode shapes to free decays: one set of poles for all channels of all hits.
///
/// Model: y(k) = sum_j Re(rho_j exp(s_j k T)) + offset + slope k + n(k); poles shared, residues of each channel and hit
/// its own, noise of each channel white with wander. Of several hits the residues of a mode are one complex shape over
/// the channels times an amplitude per hit: tested, not imposed.
/// Method: maximum likelihood by variable projection; modes one by one, each kept if noise alone gains as much with a
/// probability below `false_alarm`. The first and the last part of the decays are fitted by themselves too: where a mode
/// moves with its amplitude the last part counts, and both ends are said.
/// Shapes: `modes` by row, ascending; `shapes` over mode and channel with the modal assurance criterion over mode and
/// mode; `hits` a row per hit and mode; `course` a row per mode and part; `fit` over channel and time of the largest hit.
/// Units: Hz; shapes relative to the channel with the largest amplitude; amplitudes in the channels' units.
/// Accuracy: docs/results/decay.md. Standard errors are those of the noise that the fit leaves: of a decay that is not
/// exponential they are too small, which `course` shows.
/// Errors: no decay; too few samples; no oscillation.
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
    /// What counts where modes move while they die away: `auto`, the last part, or `whole`, all.
    pub part: FittedPart,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: ChannelOptions,
}

/// What counts where modes move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FittedPart {
    /// The last part.
    Auto,
    /// All of each decay.
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
            part: FittedPart::Auto,
            fit: ChannelOptions::default(),
        }
    }
}

pub(super) const MODES: Port<Table> = Port::new("modes", "decay-modes", "modes, ascending");
pub(super) const SHAPES: Port<Array> =
    Port::new("shapes", "mode-shapes", "complex mode shapes over mode and channel, and how alike they are");
const HITS: Port<Table> = Port::new("hits", "decay-hits", "amplitude of each mode in each hit");
const COURSE: Port<Table> = Port::new("course", "decay-course", "modes of the first and the last part of the decays");
const FIT: Port<Array> = Port::new("fit", "decay-fit", "the largest hit as measured, as fitted, and what is left");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "modes with damping and shapes, noise, what does not fit");

impl Stage for DecayFit {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.decay",
        version: 1,
        summary: "fits modes and mode shapes to free decays of several channels and hits",
        inputs: &[DECAYS.spec()],
        outputs: &[MODES.spec(), SHAPES.spec(), HITS.spec(), COURSE.spec(), FIT.spec(), SUMMARY.spec()],
        source: "G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let decays = Decays::new(inputs.get(&DECAYS)?)?;
        let Followed { fit, from, course } =
            follow(&decays, &self.options(), self.part == FittedPart::Whole).map_err(StageError::from_error)?;
        let from_s = from as f64 / decays.sample_rate_hz;
        self.warn(&fit, &decays, cx);
        course.iter().flat_map(Course::warnings).for_each(|warning| cx.warn(warning));
        if from > 0 {
            let gone: Vec<String> =
                course.iter().flat_map(Course::gone).map(|frequency_hz| format!("{frequency_hz:.6} Hz")).collect();
            let more = match gone.is_empty() {
                true => String::new(),
                false => format!("; {} died away before: `part = \"whole\"` has all", gone.join(", ")),
            };
            cx.warn(format!(
                "the modes are those of the last part, from {from_s:.4} s on, in which they are smallest; `course` has \
                 both ends{more}"
            ));
        }
        let channels: Vec<&str> = decays.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        let empty = || Course::EMPTY.table();
        Ok(Ports::new()
            .with(&MODES, damped_mode_table(&fit.modes()))
            .with(&SHAPES, shape_array(&fit.shapes.iter().collect::<Vec<_>>(), &channels))
            .with(&HITS, hit_table(&fit))
            .with(&COURSE, course.as_ref().map_or_else(empty, Course::table))
            .with(&FIT, fit_array(&fit, &decays, from))
            .with(&SUMMARY, summary(&fit, course.as_ref(), &decays, from_s)?))
    }

    fn examples() -> Vec<Example> {
        super::decay_example::examples()
    }
}

impl DecayFit {
    fn options(&self) -> ChannelOptions {
        ChannelOptions {
            modes: match self.modes {
                Count::Fixed(modes) => ModesWanted::Fixed(modes),
                Count::Auto => ModesWanted::AtMost(self.max_modes),
            },
            noise: match self.noise {
                DecayNoise::Estimated => ChannelNoise::Estimated,
                DecayNoise::White => ChannelNoise::White,
            },
            ..self.fit.clone()
        }
    }

    /// Warns where something does not fit.
    fn warn(&self, fit: &ChannelRingdown, decays: &Decays<'_>, cx: &Context) {
        if !fit.verdict.converged {
            cx.warn(format!(
                "no minimum after {} steps: the last was {:.2} standard errors",
                fit.verdict.steps, fit.verdict.distance
            ));
        }
        let found = fit.poles.len();
        if self.modes == Count::Auto && found == self.max_modes {
            cx.warn(format!("`modes = \"auto\"` found {found}, all that `max_modes` allows: there may be more"));
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
