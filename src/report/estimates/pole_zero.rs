//! Pole-zero map in the z plane, and the strip along the unit circle where weakly damped poles and zeros lie.

use afmid_pipeline::{RunResult, Table};

use crate::report::figure::{Axis, Colour, Ellipse, Figure, Mark, Marker, Panel, Points, Row};
use crate::report::find::all;
use crate::report::number::{quantity, with_error};
use crate::report::origin::Origin;

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

/// The figure of what has this origin; none without poles or zeros.
pub(crate) fn pole_zero_figure(run: &RunResult, origin: Origin) -> Option<Figure> {
    let tables =
        || all::<Table>(run).filter(|found| Origin::of(run, found.stage) == origin && found.value.real("z_re").is_ok());
    // the stage that the modal table is read from first: others may list fits of a half
    let found = tables().find(|found| found.stage.id == "modes").or_else(|| tables().last())?;
    let (poles, zeros) = (roots(found.value, "pole")?, roots(found.value, "zero")?);
    if poles.re.is_empty() && zeros.re.is_empty() {
        return None;
    }
    let sample_time_s =
        all::<afmid_pipeline::StateSpace>(run).map(|found| found.value.sample_time_s).find(|t| *t > 0.0);
    let mut panels = vec![(1.0, whole(&poles, &zeros))];
    panels.extend(strip(&poles, &zeros, sample_time_s).map(|panel| (1.15, panel)));
    let [id, title, caption] = origin.words().poles;
    Some(Figure::new(id, title, caption).row(Row { height: 400.0, panels }))
}

/// Reads the rows of one kind from a table of roots: `kind`, `z_re`, `z_im`, frequencies and quality factors with their
/// errors.
fn roots(table: &Table, kind: &str) -> Option<Roots> {
    let rows: Vec<usize> =
        table.text("kind").ok()?.iter().enumerate().filter(|(_, have)| *have == kind).map(|(row, _)| row).collect();
    let column = |name: &str| -> Option<Vec<f64>> {
        let values = table.real(name).ok()?;
        Some(rows.iter().map(|row| values.get(*row).copied().unwrap_or(f64::NAN)).collect())
    };
    let or_unknown = |name: &str| column(name).unwrap_or_else(|| vec![f64::NAN; rows.len()]);
    let (re, im) = (column("z_re")?, column("z_im")?);
    let (f, f_std) = (or_unknown("frequency_hz"), or_unknown("frequency_std_hz"));
    let (q, q_std) = (or_unknown("quality_factor"), or_unknown("quality_factor_std"));
    let class = table.text("class").ok();
    let (mut titles, mut radius_std) = (Vec::new(), Vec::new());
    for (((((row, re), im), q), q_std), (f, f_std)) in
        rows.iter().zip(&re).zip(&im).zip(&q).zip(&q_std).zip(f.iter().zip(&f_std))
    {
        let class = class.and_then(|class| class.get(*row)).map_or("", String::as_str);
        titles.push(format!("{class} {kind}: f = {}, Q = {}", quantity(*f, *f_std, "Hz"), with_error(*q, *q_std)));
        // |z| = exp(Re s Ts), and Re s = -|s| / 2Q: the logarithm of |z| has the relative error of Q (that of f is
        // small beside it)
        let radius = re.hypot(*im);
        radius_std.push((radius * radius.ln() * q_std / q).abs());
    }
    let covariance = match (column("z_re_std"), column("z_im_std"), column("z_covariance")) {
        (Some(re), Some(im), Some(both)) => re.into_iter().zip(im).zip(both).map(|((r, i), c)| (r, i, c)).collect(),
        _ => Vec::new(),
    };
    Some(Roots { re, im, titles, radius_std, covariance })
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
    // what lies as close to the circle as the poles do; a zero that is hardly known may lie far off, and would hide the
    // rest
    let farthest = poles.iter().map(|root| (1.0 - root.0).abs()).fold(0.0, f64::max);
    let farthest = if farthest > 0.0 { farthest } else { 0.02 };
    let right = poles.iter().chain(&zeros).map(|(_, angle, _, _)| angle * scale).fold(0.0, f64::max) * 1.08;
    let y = Axis::new("1 − |z|", "1").limits(-0.5 * farthest, 1.25 * farthest);
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
