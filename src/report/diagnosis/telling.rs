//! The picture that gave the cause away, first and large; the other views of the residual beside it.

use afmid_stages::causes::{self, Part};
use afmid_stages::diagnosis::{Diagnosis, Verdict};

use super::diagnosed::Diagnosed;
use super::panels;
use crate::report::figure::{Figure, Panel, Row};

/// A view of the residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum View {
    Spectrum,
    Time,
    Events,
    Amplitudes,
    Levels,
    Positions,
    Sizes,
}

impl View {
    /// All, in the order in which they stand where nothing calls for another.
    const ALL: [Self; 7] =
        [Self::Spectrum, Self::Time, Self::Sizes, Self::Events, Self::Amplitudes, Self::Levels, Self::Positions];

    fn panel(self, diagnosed: &Diagnosed<'_>) -> Option<Panel> {
        match self {
            Self::Spectrum => panels::spectrum(diagnosed),
            Self::Time => panels::over_time(diagnosed),
            Self::Events => panels::detuning(diagnosed, false),
            Self::Amplitudes => panels::event_rms(diagnosed, true),
            Self::Levels => panels::by_level(diagnosed),
            Self::Positions => panels::by_position(diagnosed),
            Self::Sizes => panels::by_size(diagnosed),
        }
    }

    /// What to look for in it.
    fn reading(self) -> &'static str {
        match self {
            Self::Spectrum => {
                "lines and humps of the linear model's residual that stand above the noise and are gone with the extended one"
            }
            Self::Time => "what the linear model leaves after the release, and how long it lasts",
            Self::Events => {
                "the frequency that each event asks for: a course over the archive is a drift, a mere scatter is none; bars are one standard error"
            }
            Self::Amplitudes => "whether large events leave more than small ones",
            Self::Levels => {
                "a course over the converter's levels: optics or converter are bent there; bars are one standard error"
            }
            Self::Positions => {
                "a course of the free level over the piezo's position: a straight line is crosstalk, a wave a fringe; bars are one standard error"
            }
            Self::Sizes => "where the output is large, or of one sign, the linear model errs more",
        }
    }
}

/// The view in which a cause shows best, by where it acts.
pub(super) fn telling(id: &str) -> View {
    let Some(about) = causes::find(id).map(|cause| cause.about()) else { return View::Spectrum };
    match (about.id, about.part) {
        ("intersample" | "piezo-ring" | "mains-hum" | "spurious-line" | "extra-mode" | "mode-coupling", _) => {
            View::Spectrum
        }
        ("photodiode-tail" | "ac-coupling" | "feedthrough" | "baseline-drift" | "offset" | "extra-pole", _) => {
            View::Time
        }
        ("piezo-crosstalk" | "interference-fringe", _) => View::Positions,
        (_, Part::Archive) => View::Events,
        (_, Part::Force) => View::Time,
        (_, Part::Lever | Part::Input) => View::Sizes,
        (_, Part::Detector | Part::Record) => View::Spectrum,
    }
}

/// The cause that a picture is chosen for: the rung that bought most, the first named one without gains, the nearest
/// where there is no name.
pub(super) fn main_cause(answer: &Diagnosis) -> Option<&str> {
    let gain = |rung: &&afmid_stages::diagnosis::Rung| rung.log_likelihood_gain.unwrap_or(0.0);
    let best = answer.ladder.iter().skip(1).max_by(|a, b| gain(a).total_cmp(&gain(b)));
    let best = best.filter(|rung| gain(rung) > 0.0).map(|rung| rung.added.as_str());
    let named = answer.causes.first().map(|cause| cause.id.as_str());
    match answer.verdict {
        Verdict::Clean => None,
        Verdict::Named | Verdict::Unexplained => {
            best.or(named).or(answer.nearest.first().map(|other| other.id.as_str()))
        }
    }
}

/// The views of the residual, the telling one first.
pub(super) fn figure(diagnosed: &Diagnosed<'_>) -> Option<Figure> {
    let cause = main_cause(&diagnosed.answer);
    let first = cause.map_or(View::Spectrum, telling);
    let order = std::iter::once(first).chain(View::ALL.into_iter().filter(|view| *view != first));
    let mut panels = order.filter_map(|view| Some((view, view.panel(diagnosed)?)));
    let (shown, large) = panels.next()?;
    let small: Vec<(f64, Panel)> = panels.map(|(_, panel)| (1.0, panel)).collect();
    let reading = shown.reading();
    let rest = "The panels below are other views of the same residual.";
    let caption = match (diagnosed.answer.verdict, cause) {
        (Verdict::Clean, _) => "Nothing stands out: the residual lies at the noise in every view.".to_owned(),
        (Verdict::Named, Some(id)) if shown == first => format!("What gave {id} away: {reading}. {rest}"),
        (Verdict::Named, _) => format!("Look for {reading}. {rest}"),
        (Verdict::Unexplained, _) => format!("What no cause accounts for. Look for {reading}. {rest}"),
    };
    let id = format!("diagnosis-{}-telling", diagnosed.slug());
    let mut figure = Figure::new(&id, "The picture that gave it away", &caption).row(Row::one(270.0, large));
    // rows of equal length, three at most
    let in_row = small.len().div_ceil(small.len().div_ceil(3).max(1)).max(1);
    for row in small.chunks(in_row) {
        figure = figure.row(Row { height: 170.0, panels: row.to_vec() });
    }
    Some(figure)
}

/// Errors over the time of the parts that judge.
pub(super) fn parts(diagnosed: &Diagnosed<'_>) -> Option<Figure> {
    let panels = panels::parts(diagnosed);
    if panels.is_empty() {
        return None;
    }
    let caption =
        "Free-run error over the parts that added no name, each point the rms of a stretch; grey: the output itself.";
    let id = format!("diagnosis-{}-parts", diagnosed.slug());
    Some(
        panels
            .into_iter()
            .fold(Figure::new(&id, "Judged parts", caption), |figure, panel| figure.row(Row::one(150.0, panel))),
    )
}
