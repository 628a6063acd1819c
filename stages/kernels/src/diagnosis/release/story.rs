//! What a report shows of a diagnosis: the mean event and what either model leaves of it, in time, in frequency and
//! event by event.

use rayon::prelude::*;

use super::joint::JointFit;
use super::problem::Problem;
use super::residuals::{Tile, common, residuals};
use super::search::Naming;
use super::story_events::{EventStory, event_stories};
use super::story_levels::{LevelStory, level_stories};
use super::story_spectra::{MeanSpectra, mean_spectra};

/// The mean event, weighted by the amplitudes, and everything beside it that a person looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// Mean event less the events' own offsets and slopes, V: the event whose amplitude is the root mean square of all.
    pub measured: Vec<f64>,
    /// What the linear model leaves of it, V.
    pub before: Vec<f64>,
    /// What the extended model leaves of it, V.
    pub after: Vec<f64>,
    /// Spectra of both rests.
    pub spectra: MeanSpectra,
    /// Event by event.
    pub events: Vec<EventStory>,
    /// Level by level of the recorded signal.
    pub levels: Vec<LevelStory>,
    /// Tiles of time and frequency of the common residual, of the linear and of the extended model, in order of time
    /// and frequency.
    pub tiles: Vec<[Tile; 2]>,
}

impl Story {
    /// What a model gives, V: the mean event less what it leaves.
    pub fn modelled(&self, rest: &[f64]) -> Vec<f64> {
        self.measured.iter().zip(rest).map(|(y, r)| y - r).collect()
    }
}

/// Collects the story of a search.
///
/// # Method
/// Means weighted by the amplitudes, `sum a_i y_i / sqrt(n sum a_i^2)`: the noise of the mean is that of one event over
/// the root of their number. Windows are those of the last fit; residuals of the first are put to the same samples,
/// since a cause may have moved the onsets.
pub fn story(problem: &Problem<'_>, naming: &Naming) -> Option<Story> {
    let (first, last) = naming.fits.first().zip(naming.fits.last())?;
    let before = aligned_residuals(problem, first, last);
    let after = residuals(problem, &last.state, &last.starts);
    let mean = |values: &[Vec<f64>]| -> Vec<f64> {
        let scale = (values.len().max(1) as f64).sqrt().recip();
        common(&last.state, values).into_iter().map(|v| v * scale).collect()
    };
    let mean_before = mean(&before);
    let (spectra, single) = mean_spectra(&last.state, &mean_before, &after, problem.cut.interval_s);
    Some(Story {
        measured: mean(&levelled(problem, last)),
        spectra,
        after: mean(&after),
        before: mean_before,
        levels: level_stories(problem, last, &before, &after),
        events: event_stories(problem, [first, last], &single),
        tiles: matched(&naming.tiles),
    })
}

/// Residuals of `fitted` at the samples of the windows of `other`; values beyond its own windows repeat the last one.
fn aligned_residuals(problem: &Problem<'_>, fitted: &JointFit, other: &JointFit) -> Vec<Vec<f64>> {
    let own = residuals(problem, &fitted.state, &fitted.starts);
    let moved = fitted.starts.iter().zip(&other.starts);
    own.into_iter()
        .zip(moved)
        .map(|(values, (from, to))| {
            let last = values.len().saturating_sub(1);
            (0..values.len())
                .map(|k| (k + to).saturating_sub(*from).min(last))
                .filter_map(|k| values.get(k).copied())
                .collect()
        })
        .collect()
}

/// The events less their own offsets and slopes.
fn levelled(problem: &Problem<'_>, fitted: &JointFit) -> Vec<Vec<f64>> {
    let samples = problem.cut.samples;
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let one = |event: usize| -> Vec<f64> {
        let (own, start) = (&fitted.state.events[event], fitted.starts[event]);
        let line = |k: usize| own.offset + own.slope * (k as f64 - centre) / centre;
        let window = &problem.windows[event].values[start..start + samples];
        window.iter().enumerate().map(|(k, y)| y - line(k)).collect()
    };
    (0..fitted.state.events.len()).into_par_iter().map(one).collect()
}

/// The same tile before and after, in order of time and frequency.
fn matched([before, after]: &[Vec<Tile>; 2]) -> Vec<[Tile; 2]> {
    let order = |a: &Tile, b: &Tile| a.from_s.total_cmp(&b.from_s).then(a.low_hz.total_cmp(&b.low_hz));
    let sorted = |tiles: &[Tile]| {
        let mut tiles = tiles.to_vec();
        tiles.sort_by(order);
        tiles
    };
    sorted(before).into_iter().zip(sorted(after)).map(|(before, after)| [before, after]).collect()
}
