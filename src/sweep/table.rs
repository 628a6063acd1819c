//! The points of a sweep side by side.

use std::collections::{BTreeMap, BTreeSet};

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::{Column, Table};
use serde_json::Value;

use super::point::Point;
use crate::batch::ledger::Entry;
use crate::batch::summary;

/// A row per point and mode; a point without modes has one row. First the swept parameters, then what a batch's table
/// has, then every number of the stages' summaries.
pub fn table(points: &[Point]) -> Table {
    let entries: Vec<Entry> = points.iter().map(|point| point.done.entry.clone()).collect();
    let rows: Vec<&Point> = points.iter().flat_map(|point| vec![point; rows_of(point)]).collect();
    let names: Vec<String> = rows.iter().map(|point| point.done.entry.name.clone()).collect();
    let mut table = Table::new().with("point", "", "name of its result file", names);
    let mut found = summary::table(&entries).columns;
    let error = found.pop();
    // the first is the name once more
    let columns = swept(&rows).into_iter().chain(found.into_iter().skip(1)).chain(numbers(&rows)).chain(error);
    for column in columns {
        let name = free(column.name, &table.columns);
        table.columns.push(Column { name, ..column });
    }
    table
}

/// Columns of a mode that people compare.
const OF_MODES: [&str; 10] = [
    "mode",
    "frequency_hz",
    "frequency_std_hz",
    "quality_factor",
    "quality_factor_std",
    "stiffness_n_per_m",
    "stiffness_std_n_per_m",
    "fit_identification_percent",
    "fit_held_out_percent",
    "verdict",
];
/// Numbers that are shown where no point has modes: the files have all.
const MOST: usize = 6;

/// What a person compares at the terminal: points, swept parameters, and what was found of the modes, or else the first
/// numbers that differ between points.
pub fn shown(points: &[Point]) -> Table {
    let table = table(points);
    let swept = points.first().map_or(0, |point| point.values.len());
    let modes = points.iter().any(|point| !point.done.entry.found.modes.is_empty());
    let failed = points.iter().any(|point| !point.done.entry.is_done());
    let mut left = MOST;
    let mut keep = |index: usize, column: &Column| {
        let named = OF_MODES.contains(&column.name.as_str()) && (modes || column.name == "verdict");
        let number = !modes && column.name.contains('.') && differs(&column.values) && left > 0;
        let keep =
            index <= swept || named && summary::is_known(&column.values) || column.name == "status" && failed || number;
        left -= usize::from(keep && index > swept && number);
        keep
    };
    let columns = table.columns.into_iter().enumerate();
    let columns = columns.filter_map(|(index, column)| keep(index, &column).then_some(column)).collect();
    Table { columns, ..Table::default() }
}

fn differs(values: &ColumnValues) -> bool {
    match values {
        ColumnValues::Real(values) => values.windows(2).any(|pair| pair[0] != pair[1] && !pair[0].is_nan()),
        _ => false,
    }
}

fn rows_of(point: &Point) -> usize {
    point.done.entry.found.modes.len().max(1)
}

/// A column per swept parameter: numbers if all its values are, else text.
fn swept(rows: &[&Point]) -> Vec<Column> {
    let names = rows.first().map(|point| point.values.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>());
    let column = |(index, name): (usize, &str)| {
        let values: Vec<&Value> = rows.iter().filter_map(|point| Some(&point.values.get(index)?.1)).collect();
        Column {
            name: name.replace('/', "_"),
            unit: if values.iter().all(|value| value.is_number()) { "1" } else { "" }.to_owned(),
            long_name: "swept parameter".to_owned(),
            values: typed(&values),
        }
    };
    names.into_iter().flatten().enumerate().map(column).collect()
}

fn typed(values: &[&Value]) -> ColumnValues {
    let all = |of: fn(&Value) -> bool| values.iter().all(|value| of(value));
    if all(Value::is_i64) {
        return values.iter().filter_map(|value| value.as_i64()).collect::<Vec<i64>>().into();
    }
    if all(Value::is_number) {
        return values.iter().filter_map(|value| value.as_f64()).collect::<Vec<f64>>().into();
    }
    if all(Value::is_boolean) {
        return values.iter().filter_map(|value| value.as_bool()).collect::<Vec<bool>>().into();
    }
    values
        .iter()
        .map(|value| value.as_str().map_or_else(|| value.to_string(), str::to_owned))
        .collect::<Vec<_>>()
        .into()
}

fn numbers(rows: &[&Point]) -> Vec<Column> {
    let found = |point: &&Point| point.done.entry.found.numbers.clone();
    let all: Vec<BTreeMap<String, f64>> = rows.iter().map(found).collect();
    let names: BTreeSet<&String> = all.iter().flat_map(BTreeMap::keys).collect();
    let column = |name: &String| {
        let values: Vec<f64> = all.iter().map(|found| found.get(name).copied().unwrap_or(f64::NAN)).collect();
        Column {
            name: name.clone(),
            unit: String::new(),
            long_name: "of the stage's summary, in the unit that its name ends in".to_owned(),
            values: values.into(),
        }
    };
    names.into_iter().map(column).collect()
}

/// A summary may name a number as a parameter is named: the parameter was there first.
fn free(mut name: String, taken: &[Column]) -> String {
    while taken.iter().any(|column| column.name == name) {
        name.push_str("_found");
    }
    name
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::Artifact;
    use serde_json::json;

    use super::*;
    use crate::batch::harvest::{Harvest, ModeFound};
    use crate::batch::work::Done;
    use crate::show::artifact_text;
    use crate::sweep::point;

    fn done(index: usize, order: i64, kind: Value, found: Harvest) -> Point {
        let entry = Entry::done(&point::name(index), "k".into(), found);
        let values = vec![("model.order".to_owned(), json!(order)), ("model.kind".to_owned(), kind)];
        Point { values, done: Done { entry, took: None, stages: (0, 0) } }
    }

    fn modes(frequencies: &[f64]) -> Harvest {
        let mode = |&f: &f64| ModeFound { frequency_hz: Some(f), ..ModeFound::default() };
        let numbers = [("model.order".to_owned(), 7.0), ("noise.std_v".to_owned(), frequencies.len() as f64)];
        Harvest { modes: frequencies.iter().map(mode).collect(), numbers: numbers.into(), ..Harvest::default() }
    }

    fn points() -> Vec<Point> {
        let mut failed = done(2, 13, json!([1, 2]), Harvest::default());
        failed.done.entry = Entry::failed(&point::name(2), None, "no".into());
        vec![done(0, 9, json!("a"), modes(&[46e3, 247e3])), done(1, 11, json!("b"), modes(&[46e3])), failed]
    }

    #[test]
    fn rows_are_points_and_modes_keyed_by_the_swept_values() {
        let table = table(&points());
        table.validate().unwrap();
        assert_eq!(table.text("point").unwrap(), ["point_00001", "point_00001", "point_00002", "point_00003"]);
        assert_eq!(table.integer("model.order").unwrap(), [9, 9, 11, 13]);
        assert_eq!(table.text("model.kind").unwrap(), ["a", "a", "b", "[1,2]"]);
        assert_eq!(table.integer("mode").unwrap(), [1, 2, 1, 0]);
        assert_eq!(table.real("noise.std_v").unwrap()[..3], [2.0, 2.0, 1.0]);
        assert_eq!(table.text("status").unwrap()[3], "failed");
        assert_eq!(table.columns.last().unwrap().name, "error");
    }

    #[test]
    fn a_number_of_a_parameters_name_does_not_take_its_column() {
        let table = table(&points());
        assert_eq!(table.real("model.order_found").unwrap()[..3], [7.0, 7.0, 7.0]);
    }

    #[test]
    fn the_terminal_shows_what_differs() {
        let text = |points: &[Point]| artifact_text(&Artifact::Table(shown(points).into()));
        let head = |text: &str| text.lines().next().unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
        let all = text(&points());
        assert_eq!(head(&all), "point model.order model.kind status mode frequency_hz [Hz]", "{all}");
        let mut without = points();
        without.pop();
        without.iter_mut().for_each(|point| point.done.entry.found.modes.clear());
        assert_eq!(head(&text(&without)), "point model.order model.kind noise.std_v");
    }

    #[test]
    fn names_of_points_sort_as_points_do() {
        // as many as a config may have
        let names: Vec<String> = (0..10_000).map(point::name).collect();
        assert!(names.is_sorted(), "they do not");
    }
}
