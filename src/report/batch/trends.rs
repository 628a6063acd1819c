//! How quantities change over the years, and which values lie apart.

use afmid_pipeline::{StageRecord, Table};

use super::{Link, table_of};
use crate::report::figure::{Axis, Colour, Figure, Mark, Marker, Panel, Points, Row, Stroke};
use crate::report::number::{number, quantity, with_error};
use crate::report::view::{Head, TableView};

/// Standard deviations from the line from which a value is called an outlier: one in some 16,000 of normal values.
const FAR: f64 = 4.0;
const MOST_ROWS: usize = 500;

/// Columns of the summary's values.
struct Values<'a> {
    quantity: &'a [String],
    unit: &'a [String],
    data_set: &'a [String],
    year: &'a [f64],
    value: &'a [f64],
    std: &'a [f64],
    off: &'a [f64],
}

impl<'a> Values<'a> {
    fn of(stage: &'a StageRecord) -> Option<Self> {
        let table = table_of(stage, "values")?;
        Some(Self {
            quantity: table.text("quantity").ok()?,
            unit: table.text("unit").ok()?,
            data_set: table.text("data_set").ok()?,
            year: table.real("year").ok()?,
            value: table.real("value").ok()?,
            std: table.real("std").ok()?,
            off: table.real("off").ok()?,
        })
    }

    /// Runs of rows of one quantity.
    fn groups(&self) -> Vec<std::ops::Range<usize>> {
        let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
        for row in 0..self.quantity.len() {
            match groups.last_mut() {
                Some(group) if self.quantity[group.start] == self.quantity[row] => group.end = row + 1,
                _ => groups.push(row..row + 1),
            }
        }
        groups
    }

    fn far(&self, row: usize) -> bool {
        self.off[row].abs() > FAR
    }
}

/// A figure for each quantity that has a value.
pub(crate) fn figures(stage: &StageRecord) -> Vec<Figure> {
    let Some(values) = Values::of(stage) else { return Vec::new() };
    values.groups().into_iter().map(|rows| figure(&values, rows, table_of(stage, "trends"))).collect()
}

fn figure(values: &Values<'_>, rows: std::ops::Range<usize>, trends: Option<&Table>) -> Figure {
    let (name, unit) = (&values.quantity[rows.start], &values.unit[rows.start]);
    let mut panel = Panel::new("", Axis::new("year", "1"), Axis::new(name, unit));
    if let Some((x, y)) = trends.and_then(|trends| line(values, &rows, trends)) {
        panel = panel.with(Mark::line("trend", &x, &y, Stroke::dashed(Colour::Ink, 1.2)));
    }
    for (series, colour, far) in [("data sets", Colour::Blue, false), ("outliers", Colour::Vermillion, true)] {
        let own: Vec<usize> = rows.clone().filter(|&row| values.far(row) == far).collect();
        if own.is_empty() {
            continue;
        }
        let pick = |of: &[f64]| own.iter().map(|&row| of[row]).collect::<Vec<f64>>();
        let title =
            |&row: &usize| format!("{}: {}", values.data_set[row], quantity(values.value[row], values.std[row], unit));
        panel = panel.with(Mark::Points(Points {
            series: series.to_owned(),
            x: pick(values.year),
            y: pick(values.value),
            y_error: pick(values.std),
            titles: own.iter().map(title).collect(),
            marker: Marker::Dot,
            colour,
        }));
    }
    let caption = "Bars: one standard error. The line is weighted by the errors.";
    Figure::new(&format!("trend-{}", name.replace(' ', "-")), name, caption).row(Row::one(260.0, panel))
}

/// The ends of a quantity's line, from the table of trends: through its value in the middle of the weighted times.
fn line(values: &Values<'_>, rows: &std::ops::Range<usize>, trends: &Table) -> Option<([f64; 2], [f64; 2])> {
    let row = trends.text("quantity").ok()?.iter().position(|name| *name == values.quantity[rows.start])?;
    let (value, slope) = (trends.real("value").ok()?[row], trends.real("per_year").ok()?[row]);
    let weight = |row: usize| values.std[row].powi(-2);
    let sound = || rows.clone().filter(|&row| values.std[row] > 0.0 && values.std[row].is_finite());
    let middle = sound().map(|row| weight(row) * values.year[row]).sum::<f64>() / sound().map(weight).sum::<f64>();
    let ends = sound().map(|row| values.year[row]).fold([f64::MAX, f64::MIN], |[a, b], t| [a.min(t), b.max(t)]);
    Some((ends, ends.map(|t| value + slope * (t - middle))))
}

/// The table of trends.
pub(crate) fn table(stage: &StageRecord) -> Option<TableView> {
    let table = table_of(stage, "trends")?;
    let (names, units, sets) = (table.text("quantity").ok()?, table.text("unit").ok()?, table.integer("sets").ok()?);
    let column = |name: &str| table.real(name).ok();
    let (value, std) = (column("value")?, column("value_std")?);
    let (slope, slope_std, scatter) = (column("per_year")?, column("per_year_std")?, column("reduced_chi_square")?);
    let heads = vec![
        Head::text("quantity"),
        Head::number("data sets", ""),
        Head::number("mean", ""),
        Head::number("change a year", ""),
        Head::number("in σ", ""),
        Head {
            about: "chi square per degree of freedom: above 1, values scatter more than their errors say".to_owned(),
            ..Head::number("scatter", "")
        },
    ];
    let mut view =
        TableView::new("In brackets: one standard error of the last digits, by the values' own errors.", heads);
    for row in 0..table.rows() {
        view.rows.push(vec![
            names[row].clone(),
            sets[row].to_string(),
            quantity(value[row], std[row], &units[row]),
            format!("{} {}", with_error(slope[row], slope_std[row]), if units[row] == "1" { "" } else { &units[row] })
                .trim_end()
                .to_owned(),
            number((100.0 * slope[row] / slope_std[row]).round() / 100.0),
            number((100.0 * scatter[row]).round() / 100.0),
        ]);
    }
    (table.rows() > 0).then_some(view)
}

/// Values far off their line, the farthest first.
pub(crate) fn outliers(stage: &StageRecord, link: &Link<'_>) -> Option<TableView> {
    let values = Values::of(stage)?;
    let mut far: Vec<usize> = (0..values.off.len()).filter(|&row| values.far(row)).collect();
    far.sort_by(|&a, &b| values.off[b].abs().total_cmp(&values.off[a].abs()));
    let heads = vec![
        Head::text("data set"),
        Head::text("quantity"),
        Head::number("value", ""),
        Head {
            about: "standard deviations of the values about the line".to_owned(),
            ..Head::number("off the line, σ", "")
        },
    ];
    let mut view = TableView::new("", heads);
    for &row in far.iter().take(MOST_ROWS) {
        view.rows.push(vec![
            values.data_set[row].clone(),
            values.quantity[row].clone(),
            quantity(values.value[row], values.std[row], &values.unit[row]),
            number((10.0 * values.off[row]).round() / 10.0),
        ]);
        view.links.push(link(&values.data_set[row]));
    }
    (!far.is_empty()).then(|| view.truncated(MOST_ROWS, far.len()))
}
