//! The residual common to all events in time and frequency, before and after.

use afmid_pipeline::Table;

use super::diagnosed::Diagnosed;
use crate::report::figure::{Axis, Band, Colour, Figure, Mark, Panel, Row};

/// Energy over the noise's from which on a tile is drawn, its word, its colour, and how many layers make it stand out.
const LEVELS: [(f64, &str, Colour, usize); 3] = [
    (2.0, "2 to 5 times the noise", Colour::Sky, 1),
    (5.0, "5 to 20 times", Colour::Orange, 2),
    (20.0, "more than 20 times", Colour::Vermillion, 3),
];
/// Probability above which a tile of so much energy is nothing: a hundred of a thousand tiles would lie below a tenth.
const CHANCE: f64 = 1e-3;

/// One panel for each model.
pub(super) fn figure(diagnosed: &Diagnosed<'_>) -> Option<Figure> {
    let table = diagnosed.table("excess_before")?;
    let mut panels = vec![(1.0, panel("Linear model", table, "before")?)];
    if diagnosed.extended() {
        panels.push((1.0, panel("Extended model", table, "after")?));
    }
    let caption = "Energy of the residual common to all events over that of the noise, in tiles of time and frequency. Drawn is what noise does less than once in 1000 tiles.";
    let id = format!("diagnosis-{}-tiles", diagnosed.slug());
    Some(Figure::new(&id, "Time and frequency", caption).row(Row { height: 200.0, panels }))
}

fn panel(title: &str, table: &Table, which: &str) -> Option<Panel> {
    let column = |name: &str| table.real(name).ok();
    let (from, to, low, high) = (column("from_s")?, column("to_s")?, column("low_hz")?, column("high_hz")?);
    let (excess, p) = (column(&format!("excess_{which}"))?, column(&format!("p_{which}"))?);
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let x = Axis::new("Time after the release", "s").limits(least(from), most(to));
    let y = Axis::frequency().limits(least(low), most(high));
    let mut panel = Panel::new(title, x, y);
    let mut shown = 0;
    for (level, (above, word, colour, layers)) in LEVELS.into_iter().enumerate() {
        let below = LEVELS.get(level + 1).map_or(f64::INFINITY, |next| next.0);
        let mut band =
            Band { series: word.to_owned(), x: Vec::new(), low: Vec::new(), high: Vec::new(), colour, fits: true };
        for tile in (0..excess.len()).filter(|k| excess[*k] >= above && excess[*k] < below && p[*k] < CHANCE) {
            // the third point breaks the band
            band.x.extend([from[tile], to[tile], f64::NAN]);
            band.low.extend([low[tile], low[tile], f64::NAN]);
            band.high.extend([high[tile], high[tile], f64::NAN]);
            shown += 1;
        }
        for _ in 0..layers {
            panel = panel.with(Mark::Band(band.clone()));
        }
    }
    if shown == 0 {
        panel.title = format!("{title}: nothing above the noise");
    }
    Some(panel)
}
