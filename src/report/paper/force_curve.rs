//! Fig. 2: the force curve, the oscillations after either event, the averaged snap-off with its force.

use afmid_pipeline::{Array, RunResult};

use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke};
use crate::report::find::{all, is_ensemble, real_over, time_axis, unit_of};
use crate::report::origin::{COUPLED, FREE, Origin};

/// Fig. 2 with the panels that the run has data for.
pub(crate) fn figure(run: &RunResult) -> Option<Figure> {
    let caption = "Deflection away from the sample is positive. The thick line is the estimate of the force that \
        acted, as the static deflection that it causes.";
    let mut figure = Figure::new("figure-2", "Force curve and events", caption);
    let mut letters = 'a'..='z';
    let mut letter = || letters.next().unwrap_or('z');
    if let Some(panel) = overview(run) {
        figure = figure.row(Row::one(200.0, titled(letter(), "The entire force curve", panel)));
    }
    let details: Vec<(f64, Panel)> = [(COUPLED, "One event: the snap to contact"), (FREE, "One event: the snap-off")]
        .into_iter()
        .filter_map(|(origin, title)| Some((1.0, titled(letter(), title, single_event(run, origin)?))))
        .collect();
    if !details.is_empty() {
        figure = figure.row(Row { height: 220.0, panels: details });
    }
    if let Some((whole, near)) = averaged(run) {
        let panels = vec![
            (3.0, titled(letter(), "The average, and the force", whole)),
            (2.0, titled(letter(), "Near the rupture", near)),
        ];
        figure = figure.row(Row { height: 260.0, panels });
    }
    (!figure.rows.is_empty()).then_some(figure)
}

fn titled(letter: char, title: &str, panel: Panel) -> Panel {
    Panel { title: format!("({letter}) {title}"), ..panel }
}

/// An overview: the least and the largest value of stretches of a record, `minimum` and `maximum` over time.
fn overview(run: &RunResult) -> Option<Panel> {
    all::<Array>(run).find_map(|found| {
        let time = time_axis(found.value)?;
        let low = real_over(found.value, "minimum", time)?;
        let high = real_over(found.value, "maximum", time)?;
        // up and down within each stretch, as the signal itself would look
        let x: Vec<f64> = time.values.iter().flat_map(|t| [*t, *t]).collect();
        let y: Vec<f64> = low.iter().zip(high).flat_map(|(low, high)| [*low, *high]).collect();
        let line = Mark::line("one record", &x, &y, Stroke::solid(Colour::Blue, 1.1));
        let axis = Axis::new("Deflection", unit_of(found.value, "minimum"));
        Some(Panel::new("", Axis::new("Time", "s"), axis).with(line))
    })
}

/// The first event of an ensemble.
fn single_event(run: &RunResult, origin: Origin) -> Option<Panel> {
    let found = all::<Array>(run).find(|found| is_ensemble(found) && found.origin(run) == origin)?;
    let time = time_axis(found.value)?;
    let signal = found.value.real("signal").ok()?.get(..time.values.len())?;
    let y = Axis::new("Deflection", unit_of(found.value, "signal"));
    let line = Mark::line("one event", &time.values, signal, Stroke::solid(Colour::Blue, 1.0));
    Some(Panel::new("", Axis::new("Time after the onset", "s"), y).with(line))
}

/// The averaged response with the force: the whole window, and the rupture enlarged.
fn averaged(run: &RunResult) -> Option<(Panel, Panel)> {
    let pairs = || {
        all::<Array>(run)
            .filter(|found| found.value.variable("force").is_ok() && found.value.variable("response").is_ok())
    };
    let found = pairs().find(|found| found.origin(run) == FREE).or_else(|| pairs().next())?;
    let time = time_axis(found.value)?;
    let response = real_over(found.value, "response", time)?;
    let force = real_over(found.value, "force", time)?;
    let y = || Axis::new("Deflection", unit_of(found.value, "response"));
    let panel = |x: Axis, markers: bool| {
        let mut panel = Panel::new("", x, y())
            .with(Mark::line("averaged response", &time.values, response, Stroke::solid(Colour::Blue, 1.1)))
            .with(Mark::line("force estimate", &time.values, force, Stroke::solid(Colour::Vermillion, 2.8)));
        if markers {
            panel = panel.with(Mark::at_x(0.0, "t₀"));
        }
        panel
    };
    let near = near_limits(&time.values, response)?;
    let label = "Time after t₀";
    Some((panel(Axis::new(label, "s"), false), panel(Axis::new(label, "s").limits(near.0, near.1), true)))
}

/// The first swings after t0: until the response has crossed its middle six times, and a third of that before.
fn near_limits(time: &[f64], response: &[f64]) -> Option<(f64, f64)> {
    let (first, last) = (*time.first()?, *time.last()?);
    if !(first.is_finite() && last.is_finite() && last > 0.0) {
        return None;
    }
    let mut crossings = 0;
    let mut end = 0.1 * last;
    let after = || time.iter().zip(response).filter(|(t, y)| **t >= 0.0 && y.is_finite());
    for ((_, before), (t, now)) in after().zip(after().skip(1)) {
        if before.signum() != now.signum() {
            crossings += 1;
            end = *t;
        }
        if crossings == 6 {
            break;
        }
    }
    let end = end.clamp(0.01 * last, last);
    (end > 0.0).then_some(((-end / 3.0).max(first), end))
}
