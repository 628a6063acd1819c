//! What was measured with both models over it, and what they leave below.

use super::diagnosed::{Curve, Diagnosed};
use crate::report::figure::{Axis, Band, Colour, Figure, Mark, Panel, Row, Stroke};

pub(super) const MEASURED: &str = "measured";
pub(super) const LINEAR: &str = "linear model";
pub(super) const EXTENDED: &str = "extended model";

/// Periods of the first mode that the overlay shows: more cannot be distinguished on a page.
const PERIODS: f64 = 8.0;

/// The line of either model, everywhere on the page.
pub(super) fn strokes(width: f64) -> [(&'static str, Stroke); 2] {
    [(LINEAR, Stroke::solid(Colour::Vermillion, width)), (EXTENDED, Stroke::solid(Colour::Blue, width))]
}

/// The overlay of the mean event, or of an output where it is largest.
pub(super) fn figure(diagnosed: &Diagnosed<'_>) -> Option<Figure> {
    let event = diagnosed.curve("time", "linear").is_some();
    let measured = diagnosed.curve("time", "measured")?;
    let models = if event { ["linear", "extended"] } else { ["before", "after"] };
    let [linear, extended] = models.map(|name| diagnosed.curve("time", name));
    let (low, high) = shown(diagnosed, measured, event)?;
    let unit = measured.unit;
    let (title, x) = if event {
        ("Mean event, weighted by amplitude", "Time after the release")
    } else {
        ("Output where it is largest", "Time")
    };
    let mut over =
        Panel::new(title, Axis::new(x, "s").bare(), Axis::new(if event { "Deflection" } else { "Output" }, unit));
    let m = measured.between(low, high);
    over = over.with(Mark::line(MEASURED, m.x, m.y, Stroke::solid(Colour::Ink, 2.6)));
    let mut rest = Panel::new("What the models leave of it", Axis::new(x, "s"), Axis::new("Residual", unit));
    if let Some(band) = noise(diagnosed, m.x) {
        rest = rest.with(band);
    }
    for ((series, stroke), model) in strokes(1.2).into_iter().zip([linear, extended]) {
        let Some(model) = model.filter(|_| series == LINEAR || diagnosed.extended()) else { continue };
        let model = model.between(low, high);
        let dashed = Stroke { dashed: series == LINEAR && diagnosed.extended(), width: 1.4, ..stroke };
        over = over.with(Mark::line(series, model.x, model.y, dashed));
        let left: Vec<f64> = m.y.iter().zip(model.y).map(|(y, s)| y - s).collect();
        rest = rest.with(Mark::line(series, m.x, &left, stroke));
    }
    let caption = caption(diagnosed, event);
    let id = format!("diagnosis-{}-overlay", diagnosed.slug());
    Some(Figure::new(&id, "Before and after", &caption).row(Row::one(230.0, over)).row(Row::one(150.0, rest)))
}

fn caption(diagnosed: &Diagnosed<'_>, event: bool) -> String {
    let what = if event {
        let events = diagnosed.curve("event", "amplitude").map_or(0, |curve| curve.y.len());
        format!(
            "Mean of {events} events, each less its own offset and slope, put on one release to the sample; the first periods of the first mode."
        )
    } else {
        "A few periods of the identification stretch round its largest output, simulated in free run.".to_owned()
    };
    let below = if event {
        " Below on its own scale; grey: two standard errors of the mean, from the scatter of the events."
    } else {
        " Below on its own scale."
    };
    let models = if diagnosed.extended() { "" } else { " There is one model: nothing has been added." };
    format!("{what}{below}{models}")
}

/// Some periods of the first mode: from the release on, or round the largest output.
fn shown(diagnosed: &Diagnosed<'_>, measured: Curve<'_>, event: bool) -> Option<(f64, f64)> {
    let (first, last) = (*measured.x.first()?, *measured.x.last()?);
    let periods = diagnosed.answer.modes_before.first().map(|mode| PERIODS / mode.frequency_hz);
    let span =
        periods.filter(|span| span.is_finite() && *span > 0.0).unwrap_or(0.125 * (last - first)).min(last - first);
    if event {
        return Some((first.max(-0.1 * span), span));
    }
    let largest = (0..measured.y.len()).filter(|k| measured.y[*k].is_finite());
    let at = largest.max_by(|a, b| measured.y[*a].abs().total_cmp(&measured.y[*b].abs()))?;
    let begin = (measured.x.get(at)? - 0.5 * span).clamp(first, last - span);
    Some((begin, begin + span))
}

/// Two standard errors of the mean event: the noise's density summed over all frequencies.
fn noise(diagnosed: &Diagnosed<'_>, time: &[f64]) -> Option<Mark> {
    let density = diagnosed.curve("frequency", "spectrum_noise")?;
    let width = density.x.get(1)? - density.x.first()?;
    let deviation = 2.0 * (density.y.iter().sum::<f64>() * width).sqrt();
    Some(Mark::Band(Band {
        series: "noise (2 σ)".to_owned(),
        x: time.to_vec(),
        low: vec![-deviation; time.len()],
        high: vec![deviation; time.len()],
        colour: Colour::Muted,
        fits: true,
    }))
}
