//! Measured frequency responses with their fit: magnitude, phase and coherence over frequency.

use afmid_pipeline::{Array, Attribute, RunResult};
use num_complex::Complex64;
use serde::Deserialize;

use crate::report::estimates::{Bode, BodeCurve, Smoothness, bode_panels, mode_rules};
use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke, slug};
use crate::report::find::{Found, all, depends_on, unit_of};
use crate::report::origin::Origin;

/// Responses that are drawn; the result file holds all.
const MOST_RESPONSES: usize = 9;

/// A point of the structure, or a channel.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Point {
    name: String,
    #[serde(default)]
    direction: String,
    #[serde(default)]
    position_m: Option<f64>,
}

impl Point {
    fn label(&self) -> String {
        format!("{}{}", self.name, self.direction)
    }
}

/// What a response is from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct ResponseOf {
    output: Point,
    input: Point,
}

impl ResponseOf {
    /// Output over input.
    fn title(&self) -> String {
        format!("{} / {}", self.output.label(), self.input.label())
    }
}

/// Measured responses by row, and their fit.
pub(super) struct Responses<'a> {
    found: Found<'a, Array>,
    frequency_hz: &'a [f64],
    of: Vec<ResponseOf>,
    frf: &'a [Complex64],
    fit: Option<Found<'a, Array>>,
}

/// All sets of measured responses of a run, but those that others are joined to.
pub(super) fn sets(run: &RunResult) -> Vec<Responses<'_>> {
    let all: Vec<Responses<'_>> = all::<Array>(run).filter_map(|found| Responses::of(run, found)).collect();
    let ids: Vec<&str> = all.iter().map(|set| set.found.stage.id.as_str()).collect();
    let joined = |set: &Responses| {
        let takes = |id: &&str| *id != set.found.stage.id && set.are_of(run, id);
        ids.iter().any(takes)
    };
    let joined: Vec<bool> = all.iter().map(joined).collect();
    all.into_iter().zip(joined).filter(|(_, joined)| !joined).map(|(set, _)| set).collect()
}

impl<'a> Responses<'a> {
    fn of(run: &'a RunResult, found: Found<'a, Array>) -> Option<Self> {
        let list = found.value.attributes.get("responses").and_then(Attribute::as_str)?;
        let fits =
            |fit: &Found<'a, Array>| fit.value.complex("fitted").is_ok() && depends_on(run, fit.stage, &found.stage.id);
        Some(Self {
            found,
            frequency_hz: &found.value.axis("frequency_hz").ok()?.values,
            of: serde_json::from_str(list).ok()?,
            frf: found.value.complex("frf").ok()?,
            fit: all::<Array>(run).find(fits),
        })
    }

    /// Whether a stage was given these responses.
    pub fn are_of(&self, run: &RunResult, stage: &str) -> bool {
        run.stage(stage).is_some_and(|stage| depends_on(run, stage, &self.found.stage.id))
    }

    /// Where the point of each row lies that goes from row to row. None where a row does not say.
    pub fn positions_m(&self) -> Option<Vec<f64>> {
        let outputs_stay = self.of.iter().all(|row| self.of.first().is_some_and(|first| row.output == first.output));
        self.of.iter().map(|row| if outputs_stay { row.input.position_m } else { row.output.position_m }).collect()
    }

    fn row<T>(values: &'a [T], number: usize, length: usize) -> Option<&'a [T]> {
        values.get(number * length..(number + 1) * length)
    }

    /// The row of a real variable over the measured frequencies.
    fn real(&self, name: &str, number: usize) -> Option<&'a [f64]> {
        Self::row(self.found.value.real(name).ok()?, number, self.frequency_hz.len())
    }

    fn curves(&self, number: usize) -> Option<Vec<BodeCurve>> {
        let measured = Self::row(self.frf, number, self.frequency_hz.len())?;
        let curve = BodeCurve::new("measured", self.frequency_hz, measured, Stroke::solid(Colour::Blue, 1.1))
            .measured(Smoothness::Noisy);
        let mut curves = vec![match self.real("variance", number) {
            Some(variance) => curve.with_variance(self.frequency_hz, measured, variance),
            None => curve,
        }];
        curves.extend(self.fit.and_then(|fit| {
            let frequency_hz = &fit.value.axis("frequency_hz").ok()?.values;
            let fitted = Self::row(fit.value.complex("fitted").ok()?, number, frequency_hz.len())?;
            Some(BodeCurve::new("fitted", frequency_hz, fitted, Stroke::dashed(Colour::Vermillion, 1.3)))
        }));
        Some(curves)
    }

    /// Magnitude, phase and, where it is known, coherence.
    fn panels(&self, number: usize, rules: &[(f64, String)]) -> Option<Vec<Panel>> {
        let bode = Bode {
            rules: rules.to_vec(),
            frequency: Axis::new("Frequency", "Hz"),
            magnitude: Axis::new(&self.quantity(), unit_of(self.found.value, "frf")).log(),
            within_a_turn: true,
            ..Bode::new(self.curves(number)?)
        };
        let (mut magnitude, mut phase) = bode_panels(&bode);
        let driving = self.found.value.attributes.get("driving_point").and_then(Attribute::as_f64);
        let point = if driving == Some(number as f64) { " · driving point" } else { "" };
        magnitude.title = format!("{}{point}", self.of.get(number)?.title());
        let Some(coherence) = self.real("coherence", number) else { return Some(vec![magnitude, phase]) };
        let below = Panel::new("", phase.x.clone(), Axis::new("Coherence", "1").limits(0.0, 1.02)).with(Mark::line(
            "coherence",
            self.frequency_hz,
            coherence,
            Stroke::solid(Colour::Green, 1.0),
        ));
        phase.x = phase.x.bare();
        Some(vec![magnitude, phase, below])
    }

    /// The quantity as a label: `Accelerance`.
    fn quantity(&self) -> String {
        let name = self.found.value.attributes.get("quantity").and_then(Attribute::as_str).unwrap_or_default();
        let mut letters = name.chars();
        match letters.next() {
            Some(first) if name != "transfer" => first.to_uppercase().chain(letters).collect(),
            _ => "Magnitude".to_owned(),
        }
    }

    fn figure(&self, run: &RunResult) -> Option<Figure> {
        let drawn = self.of.len().min(MOST_RESPONSES);
        // several panels are too narrow for words at the rules
        let mut rules = self.fit.map_or_else(Vec::new, |fit| mode_rules(run, Origin::of(run, fit.stage)));
        if drawn > 1 {
            rules.iter_mut().for_each(|(_, word)| word.clear());
        }
        let panels: Vec<Vec<Panel>> = (0..drawn).filter_map(|number| self.panels(number, &rules)).collect();
        let id = format!("responses-{}", slug(&self.found.stage.id));
        let mut figure = Figure::new(&id, "Frequency responses and their fit", &self.caption(drawn));
        let heights = if drawn > 1 { [170.0, 100.0, 60.0] } else { [320.0, 170.0, 80.0] };
        for side_by_side in panels.chunks(2) {
            for (part, height) in heights.into_iter().enumerate() {
                let panels: Vec<(f64, Panel)> =
                    side_by_side.iter().filter_map(|parts| Some((1.0, parts.get(part)?.clone()))).collect();
                if !panels.is_empty() {
                    figure = figure.row(Row { height, panels });
                }
            }
        }
        (!figure.rows.is_empty()).then_some(Figure { column_px: 1.0, ..figure })
    }

    fn caption(&self, drawn: usize) -> String {
        let rules = if self.fit.is_some() { " Dotted: the modes." } else { "" };
        let more = match self.of.len() - drawn {
            0 => String::new(),
            _ => format!(" {drawn} of {} responses are drawn; the result file holds all.", self.of.len()),
        };
        format!("Each response over its input.{rules}{more}")
    }
}

/// A figure for each set of responses.
pub(super) fn figures(run: &RunResult) -> Vec<Figure> {
    sets(run).iter().filter_map(|set| set.figure(run)).collect()
}
