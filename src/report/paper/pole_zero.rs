//! Fig. 5: pole-zero map in the z plane, and the strip along the unit circle where the lever's poles and zeros lie.

use afmid_pipeline::{RunResult, Table};

use crate::report::figure::{Axis, Colour, Ellipse, Figure, Mark, Marker, Panel, Points, Row};
use crate::report::find::{EventKind, Found, all, event_kind};
use crate::report::number::{quantity, with_error};

/// Poles or zeros of one model; of a complex pair the upper one.
#[derive(Debug, Clone, Default)]
struct Roots {
    re: Vec<f64>,
    im: Vec<f64>,
    titles: Vec<String>,
    radius_std: Vec<f64>,
    /// Error ellipses: standard errors along re and im and their covariance, where the table has them.
    covariance: Vec<(f64, f64, f64)>,
}

/// One figure for each kind of event that has poles or zeros listed.
pub(crate) fn figures(run: &RunResult) -> Vec<Figure> {
    [
        (EventKind::SnapOff, "figure-5", "Pole-zero map of the free lever"),
        (EventKind::SnapIn, "figure-5-coupled", "Pole-zero map of the coupled lever"),
    ]
    .into_iter()
    .filter_map(|(kind, id, title)| figure(run, kind, id, title))
    .collect()
}

fn figure(run: &RunResult, kind: EventKind, id: &str, title: &str) -> Option<Figure> {
    let of = |word: &str| {
        let tables =
            || all::<Table>(run).filter(|found| event_kind(run, found.stage) == kind && found.port.contains(word));
        // the modal table's own stage first: others may list half-split fits
        tables().find(|found| found.stage.id == "modes").or_else(|| tables().last()).and_then(|found| roots(&found))
    };
    let (poles, zeros) = (of("poles"), of("zeros"));
    if poles.is_none() && zeros.is_none() {
        return None;
    }
    let (poles, zeros) = (poles.unwrap_or_default(), zeros.unwrap_or_default());
    let sample_time_s =
        all::<afmid_pipeline::StateSpace>(run).map(|found| found.value.sample_time_s).find(|t| *t > 0.0);
    let mut panels = vec![(1.0, whole(&poles, &zeros))];
    panels.extend(strip(&poles, &zeros, sample_time_s).map(|panel| (1.15, panel)));
    let caption = "Weakly damped poles and zeros, close to the unit circle, belong to the lever; the others to detector and electronics. \
                   The strip shows the distance from the circle enlarged; bars: one standard error.";
    Some(Figure::new(id, title, caption).row(Row { height: 400.0, panels }))
}

/// Reads a table of roots: columns `z_real` and `z_imaginary`, and what else there is.
fn roots(found: &Found<'_, Table>) -> Option<Roots> {
    let table = found.value;
    let column = |name: &str| table.real(name).ok();
    let (re, im) = (column("z_real")?, column("z_imaginary")?);
    let unknown = vec![f64::NAN; re.len()];
    let or_unknown = |name: &str| column(name).unwrap_or(&unknown);
    let (f, f_std) = (or_unknown("frequency_hz"), or_unknown("frequency_std_hz"));
    let (q, q_std) = (or_unknown("quality_factor"), or_unknown("quality_factor_std"));
    let titles = (0..re.len()).map(|k| {
        let at = |values: &[f64]| values.get(k).copied().unwrap_or(f64::NAN);
        format!("f = {}, Q = {}", quantity(at(f), at(f_std), "Hz"), with_error(at(q), at(q_std)))
    });
    let radius_std = match column("z_radius_std") {
        Some(std) => std.to_vec(),
        None => (0..re.len())
            .map(|k| {
                let at = |values: &[f64]| values.get(k).copied().unwrap_or(f64::NAN);
                // 1 - |z| is nearly |arg z| / 2Q: the relative error of the distance is Q's
                (1.0 - at(re).hypot(at(im))).abs() * at(q_std) / at(q).abs()
            })
            .collect(),
    };
    let covariance = match (column("z_real_std"), column("z_imaginary_std"), column("z_covariance")) {
        (Some(re), Some(im), Some(both)) => re.iter().zip(im).zip(both).map(|((r, i), c)| (*r, *i, *c)).collect(),
        _ => Vec::new(),
    };
    Some(Roots { re: re.to_vec(), im: im.to_vec(), titles: titles.collect(), radius_std, covariance })
}

fn points(series: &str, x: Vec<f64>, y: Vec<f64>, y_error: Vec<f64>, titles: Vec<String>) -> Mark {
    let (marker, colour) =
        if series == "pole" { (Marker::Cross, Colour::Vermillion) } else { (Marker::Ring, Colour::Blue) };
    Mark::Points(Points { series: series.to_owned(), x, y, y_error, titles, marker, colour })
}

/// The z plane with the unit circle; lower halves of pairs are mirrored.
fn whole(poles: &Roots, zeros: &Roots) -> Panel {
    let reach = poles.re.iter().chain(&zeros.re).chain(&poles.im).chain(&zeros.im);
    // zeros far outside would shrink the circle to a dot: the map ends at twice its radius
    let reach = reach.map(|value| value.abs()).filter(|value| *value < 2.0).fold(1.0, f64::max) * 1.12;
    let mut panel = Panel::new(
        "z plane",
        Axis::new("Re z", "1").limits(-reach, reach),
        Axis::new("Im z", "1").limits(-reach, reach),
    );
    panel.equal_scales = true;
    let circle = Ellipse {
        series: String::new(),
        centre: (0.0, 0.0),
        radii: (1.0, 1.0),
        angle_rad: 0.0,
        colour: Colour::Muted,
        filled: false,
    };
    panel = panel.with(Mark::Ellipse(circle));
    for (series, roots) in [("zero", zeros), ("pole", poles)] {
        let lower: Vec<usize> = (0..roots.re.len()).filter(|&k| roots.im.get(k).is_some_and(|im| *im != 0.0)).collect();
        let mirrored = |values: &[f64], sign: f64| -> Vec<f64> {
            let pairs = lower.iter().filter_map(|&k| values.get(k).map(|value| sign * value));
            values.iter().copied().chain(pairs).collect()
        };
        for ((re, im), covariance) in roots.re.iter().zip(&roots.im).zip(&roots.covariance) {
            panel = panel.with(error_ellipse(series, (*re, *im), *covariance));
        }
        panel = panel.with(points(
            series,
            mirrored(&roots.re, 1.0),
            mirrored(&roots.im, -1.0),
            Vec::new(),
            roots.titles.clone(),
        ));
    }
    panel
}

/// The 95 % region of a root: half axes sqrt(5.99 lambda) of its covariance (chi-square with two degrees of freedom).
fn error_ellipse(series: &str, centre: (f64, f64), (re_std, im_std, covariance): (f64, f64, f64)) -> Mark {
    let (a, c, b) = (re_std * re_std, im_std * im_std, covariance);
    let (mean, spread) = (0.5 * (a + c), (0.25 * (a - c).powi(2) + b * b).sqrt());
    Mark::Ellipse(Ellipse {
        series: series.to_owned(),
        centre,
        radii: ((5.99 * (mean + spread)).sqrt(), (5.99 * (mean - spread).max(0.0)).sqrt()),
        angle_rad: 0.5 * (2.0 * b).atan2(a - c),
        colour: if series == "pole" { Colour::Vermillion } else { Colour::Blue },
        filled: true,
    })
}

/// Distance from the unit circle over frequency, for what lies close to it.
fn strip(poles: &Roots, zeros: &Roots, sample_time_s: Option<f64>) -> Option<Panel> {
    let close = |roots: &Roots| -> Vec<(f64, f64, f64, String)> {
        let rows = roots.re.iter().zip(&roots.im).zip(&roots.radius_std).zip(&roots.titles);
        rows.map(|(((re, im), std), title)| (re.hypot(*im), im.atan2(*re), *std, title.clone()))
            .filter(|(radius, angle, _, _)| (radius - 1.0).abs() < 0.02 && *angle > 0.0)
            .collect()
    };
    let (poles, zeros) = (close(poles), close(zeros));
    if poles.is_empty() && zeros.is_empty() {
        return None;
    }
    let (unit, scale) = match sample_time_s {
        Some(t) => (Axis::new("arg z, as a frequency", "Hz"), 1.0 / (std::f64::consts::TAU * t)),
        None => (Axis::new("arg z", "rad"), 1.0),
    };
    let radii = || poles.iter().chain(&zeros).map(|(radius, _, _, _)| *radius);
    let (low, high) = (radii().fold(1.0, f64::min), radii().fold(1.0, f64::max));
    let room = 0.12 * (high - low).max(1e-4);
    let right = poles.iter().chain(&zeros).map(|(_, angle, _, _)| angle * scale).fold(0.0, f64::max) * 1.08;
    let y = Axis::new("1 − |z|", "1").limits(1.0 - high - room, 1.0 - low + room);
    let mut panel =
        Panel::new("along the unit circle, enlarged", unit.limits(0.0, right), y).with(Mark::at_y(0.0, "unit circle"));
    for (series, roots) in [("zero", zeros), ("pole", poles)] {
        panel = panel.with(points(
            series,
            roots.iter().map(|root| root.1 * scale).collect(),
            roots.iter().map(|root| 1.0 - root.0).collect(),
            roots.iter().map(|root| root.2).collect(),
            roots.iter().map(|root| root.3.clone()).collect(),
        ));
    }
    Some(panel)
}
