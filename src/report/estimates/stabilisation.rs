//! Stabilisation diagram: poles of every order over frequency.

use afmid_pipeline::{RunResult, Table};

use crate::report::figure::{Axis, Colour, Figure, Mark, Marker, Panel, Points, Row, slug};
use crate::report::find::all;

/// What a pole is marked as: its series, and how it is drawn.
const MARKS: [(&str, Marker, Colour); 3] = [
    ("not stable", Marker::Dot, Colour::Muted),
    ("stable", Marker::Ring, Colour::Blue),
    ("mode", Marker::Cross, Colour::Vermillion),
];

/// One figure for each stage that lists poles by order.
pub(crate) fn stabilisation_figures(run: &RunResult) -> Vec<Figure> {
    all::<Table>(run).filter_map(|found| figure(&found.stage.id, found.value)).collect()
}

fn figure(stage: &str, table: &Table) -> Option<Figure> {
    let panel = Panel::new("", Axis::frequency(), Axis::new("order", "1").whole());
    let mut panel = pole_marks(panel, table)?;
    if let Some(order) = table.attributes.get("proposed_order").and_then(afmid_pipeline::Attribute::as_f64) {
        panel = panel.with(Mark::at_y(order, "proposed order"));
    }
    let caption = "A mode stands in a column from the order on that can hold it; a pole that noise needs wanders. \
        Stable: frequency and damping as at the next lower order.";
    Some(
        Figure::new(&format!("stabilisation-{}", slug(stage)), "Stabilisation diagram", caption)
            .row(Row::one(380.0, panel)),
    )
}

/// The panel with the poles of a table; none without poles.
pub(crate) fn pole_marks(mut panel: Panel, table: &Table) -> Option<Panel> {
    let (f, order) = (table.real("frequency_hz").ok()?, table.integer("order").ok()?);
    let (stable, mode) = (table.flag("damping_stable").ok()?, table.integer("mode").ok()?);
    if f.is_empty() {
        return None;
    }
    for (class, (series, marker, colour)) in MARKS.into_iter().enumerate() {
        let own = |row: &usize| class == if mode[*row] > 0 { 2 } else { usize::from(stable[*row]) };
        let rows: Vec<usize> = (0..table.rows()).filter(own).collect();
        panel = panel.with(Mark::Points(Points {
            series: series.to_owned(),
            x: rows.iter().map(|&row| f[row]).collect(),
            y: rows.iter().map(|&row| order[row] as f64).collect(),
            y_error: Vec::new(),
            titles: Vec::new(),
            marker,
            colour,
        }));
    }
    Some(panel)
}
