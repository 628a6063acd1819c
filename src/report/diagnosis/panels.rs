//! The residuals' small multiples: by frequency, over time, event by event, by size.

use super::diagnosed::{Curve, Diagnosed};
use super::overlay::{EXTENDED, LINEAR, strokes};
use crate::report::figure::{Axis, Band, Colour, Mark, Marker, Panel, Points, Stroke};

/// The spectrum of the residual with the places where causes show.
pub(super) fn spectrum(diagnosed: &Diagnosed<'_>) -> Option<Panel> {
    let before = diagnosed.curve("frequency", "spectrum_before")?;
    let y = Axis::new("Density", before.unit).log();
    let x = Axis { label: "Frequency".to_owned(), ..Axis::frequency() };
    let mut panel = Panel::new("Spectrum of the residual", x, y);
    for (name, (series, stroke)) in ["spectrum_before", "spectrum_after"].into_iter().zip(strokes(1.0)) {
        if let Some(density) = diagnosed.curve("frequency", name).filter(|_| series == LINEAR || diagnosed.extended()) {
            panel = panel.with(Mark::line(series, density.x, &smoothed(density.y), stroke));
        }
    }
    for (name, series) in [("spectrum_noise", "noise level"), ("spectrum_output", "output")] {
        if let Some(level) = diagnosed.curve("frequency", name) {
            panel = panel.with(Mark::line(series, level.x, level.y, Stroke::solid(Colour::Ink, 1.1)));
        }
    }
    Some(marks(diagnosed).into_iter().fold(panel, |panel, (at, label)| panel.with(Mark::at_x(at, &label))))
}

/// Most bins on either side that a drawn density is averaged over, and the bins of which that is one: a periodogram
/// scatters by as much as it is, and no peak may vanish, so the average is narrower than a fiftieth of the frequency.
const SIDE: usize = 6;
const NARROW: usize = 50;

fn smoothed(density: &[f64]) -> Vec<f64> {
    (0..density.len())
        .map(|k| {
            let side = (k / NARROW).min(SIDE);
            let near = density.get(k - side..(k + side + 1).min(density.len())).unwrap_or(&[]);
            near.iter().sum::<f64>() / near.len() as f64
        })
        .collect()
}

/// Modes, combinations of the first two, and frequencies that a named cause has.
fn marks(diagnosed: &Diagnosed<'_>) -> Vec<(f64, String)> {
    let modes: Vec<f64> = diagnosed.answer.modes_before.iter().map(|mode| mode.frequency_hz).collect();
    let mut out: Vec<(f64, String)> =
        modes.iter().enumerate().map(|(m, f)| (*f, format!("f{}", subscript(m + 1)))).collect();
    if let Some(first) = modes.first() {
        out.push((2.0 * first, "2 f₁".to_owned()));
        out.push((3.0 * first, "3 f₁".to_owned()));
        if let Some(second) = modes.get(1) {
            out.push((second - first, "f₂ − f₁".to_owned()));
            out.push((second + first, "f₂ + f₁".to_owned()));
        }
    }
    for cause in &diagnosed.answer.causes {
        let own = cause.parameters.values().filter(|value| value.unit == "Hz").filter_map(|value| value.value);
        out.extend(own.map(|f| (f, cause.id.clone())));
    }
    out
}

fn subscript(number: usize) -> String {
    let digits = ['₀', '₁', '₂', '₃', '₄', '₅', '₆', '₇', '₈', '₉'];
    number.to_string().chars().filter_map(|c| digits.get(c.to_digit(10)? as usize)).collect()
}

/// The residual over the whole window or record.
pub(super) fn over_time(diagnosed: &Diagnosed<'_>) -> Option<Panel> {
    let event = diagnosed.curve("time", "linear").is_some();
    let x = Axis::new(if event { "Time after the release" } else { "Time" }, "s");
    let before = diagnosed.curve("time", "before")?;
    let mut panel = Panel::new("Residual over time", x, Axis::new("Residual", before.unit));
    let measured = diagnosed.curve("time", "measured");
    for (name, (series, stroke)) in ["before", "after"].into_iter().zip(strokes(0.8)) {
        let Some(curve) = diagnosed.curve("time", name).filter(|_| series == LINEAR || diagnosed.extended()) else {
            continue;
        };
        // of a system the models are stored, of events their residuals
        let left: Vec<f64> = match measured.filter(|_| !event) {
            Some(measured) => measured.y.iter().zip(curve.y).map(|(y, s)| y - s).collect(),
            None => curve.y.to_vec(),
        };
        panel = panel.with(Mark::line(series, curve.x, &left, stroke));
    }
    Some(panel)
}

/// The frequency that each event asks of the linear model.
pub(super) fn detuning(diagnosed: &Diagnosed<'_>, by_amplitude: bool) -> Option<Panel> {
    let (shift, std) = (diagnosed.curve("event", "frequency_shift")?, diagnosed.curve("event", "frequency_shift_std")?);
    let (x, axis) = abscissa(diagnosed, shift, by_amplitude)?;
    let ppm = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| 1e6 * value).collect() };
    let (y, y_error) = (ppm(shift.y), ppm(std.y));
    let titles = (0..y.len()).map(|k| format!("event {}: {:.0} ± {:.0} ppm", k + 1, y[k], y_error[k])).collect();
    let points =
        Points { series: LINEAR.to_owned(), x, y, y_error, titles, marker: Marker::Dot, colour: Colour::Vermillion };
    let ends = points.y.iter().zip(&points.y_error).flat_map(|(y, e)| [y - e, y + e]);
    let (low, high) = padded(ends);
    let panel = Panel::new("Each event's first mode", axis, Axis::new("f₁ off by", "ppm").limits(low, high));
    Some(panel.with(Mark::Points(points)).with(Mark::at_y(0.0, "")))
}

/// The mean residual where the recorded signal stood at one level.
pub(super) fn by_level(diagnosed: &Diagnosed<'_>) -> Option<Panel> {
    course(diagnosed, "level", "level", ["Residual by level", "Level at the converter", "Mean residual"])
}

/// The free level where the piezo stood at one position, nothing assumed of its course.
pub(super) fn by_position(diagnosed: &Diagnosed<'_>) -> Option<Panel> {
    course(diagnosed, "position", "free", ["Free level by position", "Position of the piezo", "Free level"])
}

/// Values before and after with their errors along an axis; title, names of the axes.
fn course(diagnosed: &Diagnosed<'_>, axis: &str, name: &str, [title, x, y]: [&str; 3]) -> Option<Panel> {
    let before = diagnosed.curve(axis, &format!("{name}_before"))?;
    let mut panel = Panel::new(title, Axis::new(x, before.x_unit), Axis::new(y, before.unit));
    for (when, series, marker, colour) in
        [("before", LINEAR, Marker::Dot, Colour::Vermillion), ("after", EXTENDED, Marker::Ring, Colour::Blue)]
    {
        let std = diagnosed.curve(axis, &format!("{name}_{when}_std"));
        // causes of whole records are taken out without a rung of the ladder
        let shown = series == LINEAR || diagnosed.extended() || !diagnosed.answer.causes.is_empty();
        let rest = diagnosed.curve(axis, &format!("{name}_{when}")).filter(|_| shown);
        let Some((rest, std)) = rest.zip(std) else { continue };
        let (series, x, y, y_error) = (series.to_owned(), rest.x.to_vec(), rest.y.to_vec(), std.y.to_vec());
        panel = panel.with(Mark::Points(Points { series, x, y, y_error, titles: Vec::new(), marker, colour }));
    }
    Some(panel.with(Mark::at_y(0.0, "")))
}

/// The rms residual of each event.
pub(super) fn event_rms(diagnosed: &Diagnosed<'_>, by_amplitude: bool) -> Option<Panel> {
    let before = diagnosed.curve("event", "event_rms_before")?;
    let (x, axis) = abscissa(diagnosed, before, by_amplitude)?;
    let mut panel = Panel::new("Each event's residual", axis, Axis::new("Rms residual", before.unit));
    for (name, series, marker, colour) in [
        ("event_rms_before", LINEAR, Marker::Dot, Colour::Vermillion),
        ("event_rms_after", EXTENDED, Marker::Ring, Colour::Blue),
    ] {
        let Some(rms) = diagnosed.curve("event", name).filter(|_| series == LINEAR || diagnosed.extended()) else {
            continue;
        };
        let (series, x, y) = (series.to_owned(), x.clone(), rms.y.to_vec());
        panel =
            panel.with(Mark::Points(Points { series, x, y, y_error: Vec::new(), titles: Vec::new(), marker, colour }));
    }
    Some(panel)
}

fn abscissa(diagnosed: &Diagnosed<'_>, of: Curve<'_>, by_amplitude: bool) -> Option<(Vec<f64>, Axis)> {
    if by_amplitude {
        let amplitude = diagnosed.curve("event", "amplitude")?;
        let (low, high) = padded(amplitude.y.iter().copied());
        return Some((amplitude.y.to_vec(), Axis::new("Amplitude of the event", amplitude.unit).limits(low, high)));
    }
    let count = of.x.len() as f64;
    let axis = Axis::new("Event, in the archive's order", "1").limits(0.5, count + 0.5).whole();
    Some((of.x.iter().map(|k| k + 1.0).collect(), axis))
}

/// Limits with room for markers.
fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), value| (l.min(value), h.max(value)));
    let room = 0.06 * (high - low);
    (low - room, high + room)
}

/// The error by the size of the output.
pub(super) fn by_size(diagnosed: &Diagnosed<'_>) -> Option<Panel> {
    let before = diagnosed.curve("output", "rms_before")?;
    let y = Axis::new("Rms error", before.unit).log();
    let mut panel = Panel::new("Error by the output's size", Axis::new("Output", before.x_unit), y);
    for (name, (series, stroke)) in ["rms_before", "rms_after"].into_iter().zip(strokes(1.6)) {
        if let Some(curve) = diagnosed.curve("output", name).filter(|_| series == LINEAR || diagnosed.extended()) {
            panel = panel.with(Mark::line(series, curve.x, curve.y, stroke));
        }
    }
    Some(panel)
}

/// The error over the time of each part that judges.
pub(super) fn parts(diagnosed: &Diagnosed<'_>) -> Vec<Panel> {
    let Some(table) = diagnosed.table("part") else { return Vec::new() };
    let columns =
        (table.text("part"), table.real("time_s"), table.real("output"), table.real("before"), table.real("after"));
    let (Ok(part), Ok(time), Ok(output), Ok(before), Ok(after)) = columns else { return Vec::new() };
    let unit = table.column("before").map_or("1", |column| &column.unit);
    let mut names: Vec<&String> = part.iter().collect();
    names.dedup();
    let panel = |name: &String| {
        let own = |values: &[f64]| -> Vec<f64> {
            part.iter().zip(values).filter(|(part, _)| *part == name).map(|(_, value)| *value).collect()
        };
        let x = own(time);
        let muted = Band {
            series: "output".to_owned(),
            low: vec![f64::MIN_POSITIVE; x.len()],
            high: own(output),
            x: x.clone(),
            colour: Colour::Muted,
            fits: false,
        };
        let y = Axis::new("Rms error", unit).log();
        let mut panel = Panel::new(&format!("Part “{name}”"), Axis::new("Time", "s"), y).with(Mark::Band(muted));
        for (values, (series, stroke)) in [before, after].into_iter().zip(strokes(1.2)) {
            if series == LINEAR || diagnosed.extended() {
                panel = panel.with(Mark::line(series, &x, &own(values), stroke));
            }
        }
        panel
    };
    names.into_iter().map(panel).collect()
}
