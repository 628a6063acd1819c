//! The `[sweep]` table: parameters that are run through lists of values.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::RESERVED_ID;
use super::overrides::{self, Override};
use super::problem::Problem;
use super::value::found;

/// One swept parameter.
#[derive(Debug, Clone)]
pub struct Swept {
    /// `stage.param`.
    pub name: String,
    /// What it is set to, in order; at least one.
    pub(crate) values: Vec<Override>,
}

/// More points than anybody waits for: most likely a list in the wrong place.
const MOST_POINTS: usize = 10_000;

const FORM: &str = "write a list of values, such as `\"model.order\" = [9, 11, 13]`";

impl Swept {
    /// The id of its stage.
    pub(crate) fn stage(&self) -> &str {
        self.values.first().and_then(Override::stage).unwrap_or_default()
    }

    /// Whether an argument sets it, a part of it or what it is part of: then the argument counts.
    pub(super) fn is_set_by(&self, set: &Override) -> bool {
        self.values.first().is_some_and(|own| own.overlaps(set))
    }
}

/// Reads the table, in the order of the text.
pub(super) fn read(value: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) -> Vec<Swept> {
    let Some(table) = value.get_ref().as_table() else {
        let message = format!("`sweep`: found {}, wanted a table", found(value.get_ref()));
        problems.push(Problem::new(message, value.span(), "wanted a table").help(FORM));
        return Vec::new();
    };
    if table.is_empty() {
        problems.push(Problem::new("[sweep] is empty, wanted parameters", value.span(), "no parameter").help(FORM));
    }
    let mut axes: Vec<(Range<usize>, Swept)> = Vec::new();
    walk(table, &[], &mut axes, problems);
    axes.sort_by_key(|(key, _)| key.start);
    let mut kept: Vec<Swept> = Vec::new();
    for (key, axis) in axes {
        match kept.iter().find(|other| axis.values.first().is_some_and(|own| other.is_set_by(own))) {
            Some(other) => {
                let message = format!("[sweep] gives `{}` twice", axis.name);
                let help = format!("`{}` and `{}` are one parameter: remove one", other.name, axis.name);
                problems.push(Problem::new(message, key, "given before").help(help));
            }
            None => kept.push(axis),
        }
    }
    let points = kept.iter().try_fold(1_usize, |points, axis| points.checked_mul(axis.values.len()));
    if points.is_none_or(|points| points > MOST_POINTS) {
        let message = format!("the sweep has more than {MOST_POINTS} points: the product of the lengths of its lists");
        problems.push(Problem::new(message, value.span(), "too many").help("sweep fewer values at once"));
        kept.clear();
    }
    kept
}

/// Parameters in quotes (`"a.b" = [...]`) and dotted (`a.b = [...]`) alike.
fn walk(
    table: &DeTable<'_>,
    above: &[(String, Range<usize>)],
    axes: &mut Vec<(Range<usize>, Swept)>,
    problems: &mut Vec<Problem>,
) {
    for (key, value) in table {
        let mut path = above.to_vec();
        let steps = overrides::steps(key.get_ref()).unwrap_or_else(|| vec![key.get_ref().to_string()]);
        path.extend(steps.into_iter().map(|step| (step, key.span())));
        match value.get_ref() {
            DeValue::Table(inner) if !inner.is_empty() => walk(inner, &path, axes, problems),
            other => match swept(path, key.span(), other, value.span(), problems) {
                Ok(axis) => axes.push((key.span(), axis)),
                Err(problem) => problems.push(problem),
            },
        }
    }
}

fn swept(
    path: Vec<(String, Range<usize>)>,
    key: Range<usize>,
    value: &DeValue<'_>,
    span: Range<usize>,
    problems: &mut Vec<Problem>,
) -> Result<Swept, Problem> {
    let name = overrides::dotted(&path);
    let wrong =
        |message: String, span: &Range<usize>, label: &str| Problem::new(message, span.clone(), label).help(FORM);
    let elements = match value {
        DeValue::Array(elements) if !elements.is_empty() => elements,
        other => {
            let what = if other.as_array().is_some() { "an empty list".to_owned() } else { found(other) };
            return Err(wrong(
                format!("[sweep] `{name}`: found {what}, wanted a list of values"),
                &span,
                "no list of values",
            ));
        }
    };
    match path.first() {
        Some((id, _)) if id == RESERVED_ID => {
            let message = format!("[sweep] `{name}`: only parameters of stages can be swept");
            Err(Problem::new(message, key, "no stage").help("run the config several times with --set instead"))
        }
        Some(_) if path.len() > 1 => {
            let values = elements.iter().map(|element| Override::swept(&path, element, problems)).collect();
            Ok(Swept { name, values })
        }
        _ => Err(wrong(format!("[sweep] `{name}` names no parameter, wanted STAGE.PARAM"), &key, "wanted STAGE.PARAM")),
    }
}

/// The place of a point in the grid of lists of these lengths, the last list running fastest.
pub(crate) fn point(lengths: impl DoubleEndedIterator<Item = usize>, mut index: usize) -> Vec<usize> {
    let mut place: Vec<usize> = lengths
        .rev()
        .map(|length| {
            let here = index.checked_rem(length).unwrap_or(0);
            index = index.checked_div(length).unwrap_or(0);
            here
        })
        .collect();
    place.reverse();
    place
}

#[cfg(test)]
mod tests {
    use super::point;

    #[test]
    fn the_last_list_runs_fastest() {
        let places: Vec<Vec<usize>> = (0..6).map(|index| point([2, 3].into_iter(), index)).collect();
        assert_eq!(places, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
    }
}
