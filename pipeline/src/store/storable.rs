//! Whether an artifact can be stored: names that HDF5 takes, texts that it keeps whole. Found out before anything is
//! written, an artifact that cannot be stored is the fault of one stage and costs the others nothing.

use std::collections::{BTreeMap, HashSet};

use super::array::stored_names;
use crate::artifact::{Array, Artifact, Attribute, ColumnValues, StateSpace, Table};
use crate::error::StageError;
use crate::hdf5_files::write::check_name;
use crate::recording::Recording;

type Checked = Result<(), String>;

/// Sees that an artifact can be stored. Errors: a name that is none of an HDF5 object, or is that of two; a text with a
/// NUL.
pub(crate) fn check_storable(artifact: &Artifact) -> Result<(), StageError> {
    let checked = match artifact {
        Artifact::Array(array) => check_array(array),
        Artifact::Table(table) => check_table(table),
        Artifact::StateSpace(model) => check_model(model),
        Artifact::Recording(recording) => check_recording(recording),
        // JSON escapes whatever is in it
        Artifact::Document(_) => Ok(()),
    };
    checked.map_err(|problem| StageError::new(format!("cannot be stored: {problem}")))
}

fn check_array(array: &Array) -> Checked {
    for axis in &array.axes {
        let what = || format!("axis {:?}", axis.name);
        named("axis", &axis.name)?;
        whole(what, [&axis.unit, &axis.long_name])?;
    }
    for variable in &array.variables {
        let what = || format!("variable {:?}", variable.name);
        named("variable", &variable.name)?;
        whole(what, [&variable.unit, &variable.long_name])?;
    }
    let mut taken: HashSet<String> = array.axes.iter().map(|axis| axis.name.clone()).collect();
    for variable in &array.variables {
        if let Some(twice) = stored_names(variable).into_iter().find(|name| !taken.insert(name.clone())) {
            return Err(format!(
                "variable {:?} is stored as {twice:?}, and so is another one: rename it",
                variable.name
            ));
        }
    }
    check_attributes(&array.attributes)
}

fn check_table(table: &Table) -> Checked {
    for column in &table.columns {
        let what = || format!("column {:?}", column.name);
        named("column", &column.name)?;
        whole(what, [&column.unit, &column.long_name])?;
        if let ColumnValues::Text(texts) = &column.values {
            whole(what, texts)?;
        }
    }
    check_attributes(&table.attributes)
}

fn check_model(model: &StateSpace) -> Checked {
    whole(|| "a name of a parameter".to_owned(), &model.parameter_names)?;
    check_attributes(&model.attributes)
}

fn check_recording(recording: &Recording) -> Checked {
    for record in &recording.records {
        whole(|| format!("record {:?}", record.name), [&record.name, &record.started_at])?;
        for channel in &record.channels {
            let texts = [&channel.role, &channel.location, &channel.unit, &channel.long_name];
            whole(|| format!("channel {:?} of {:?}", channel.location, record.name), texts)?;
        }
    }
    Ok(())
}

fn check_attributes(attributes: &BTreeMap<String, Attribute>) -> Checked {
    for (name, value) in attributes {
        // a name of an attribute is no path: it may hold a `/`, and an empty one is stored under another
        if name.len() > MOST_NAME_BYTES || name.contains('\0') {
            return Err(format!("attribute {}: {}", shortened(name), wanted("no NUL")));
        }
        whole(|| format!("attribute {name:?}"), value.as_str())?;
    }
    Ok(())
}

/// Bytes of a name. Why: HDF5 keeps names in headers of 64 KiB, several of them in one.
const MOST_NAME_BYTES: usize = 1000;

/// Errors: no name of an HDF5 object.
fn named(what: &str, name: &str) -> Checked {
    if name.len() <= MOST_NAME_BYTES && check_name(name).is_ok() {
        return Ok(());
    }
    let rule = wanted("no `/`, no NUL, neither `.` nor `..`");
    Err(format!("{what} {}: {rule}", shortened(name)))
}

fn wanted(rule: &str) -> String {
    format!("wanted a name of 1 to {MOST_NAME_BYTES} bytes, {rule}")
}

/// Letters of a name that a message shows.
const SHOWN_LETTERS: usize = 60;

fn shortened(name: &str) -> String {
    let shown: String = name.chars().take(SHOWN_LETTERS).collect();
    let more =
        if shown.len() < name.len() { format!(" and {} bytes more", name.len() - shown.len()) } else { String::new() };
    format!("{shown:?}{more}")
}

/// Errors: a text with a NUL, at which HDF5 would end it.
fn whole<T: AsRef<str>>(what: impl Fn() -> String, texts: impl IntoIterator<Item = T>) -> Checked {
    match texts.into_iter().any(|text| text.as_ref().contains('\0')) {
        true => Err(format!("{} has a text with a NUL character, which ends a text in HDF5: remove it", what())),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::artifact::{Axis, Shaped};

    fn problem(artifact: Artifact) -> String {
        check_storable(&artifact).expect_err("it cannot be stored").to_string()
    }

    fn array(variable: &str) -> Array {
        Array::over(vec![Axis::new("n", "1", "n", vec![0.0])]).with(variable, "V", "", &["n"], vec![1.0])
    }

    #[test]
    fn names_and_texts_that_hdf5_does_not_take_are_found_out() {
        let long = "x".repeat(MOST_NAME_BYTES + 1);
        for name in ["", ".", "..", "a/b", "../../x", "a\0b", &long] {
            let table = Table::new().with(name, "1", "", vec![1.0]);
            assert!(problem(table.wrap()).contains("column"), "{name:?}");
            assert!(problem(array(name).wrap()).contains("variable"), "{name:?}");
            let of_axis = Array::over(vec![Axis::new(name, "1", "", vec![0.0])]).with("v", "V", "", &[], vec![1.0]);
            assert!(problem(of_axis.wrap()).contains("axis"), "{name:?}");
        }
        assert!(problem(array("v").attribute("a\0", 1.0).wrap()).contains("attribute"));
        assert!(problem(array("v").attribute("a", "\0").wrap()).contains("NUL"));
        let text = Table::new().with("t", "", "", vec!["a\0".to_owned()]);
        assert!(problem(text.wrap()).contains("column \"t\" has a text with a NUL"));
        assert!(problem(Table::new().with("t", "\0", "", vec![1.0]).wrap()).contains("NUL"));
        for name in ["a", "..x", "a b", "\u{e9}\u{1}", &long[..MOST_NAME_BYTES]] {
            check_storable(&array(name).attribute("a/b", 1.0).attribute("", 2.0).wrap()).expect(name);
        }
    }

    #[test]
    fn parts_of_a_complex_variable_take_no_other_ones_name() {
        let complex = |name: &str| array("x_real").with(name, "1", "", &["n"], vec![Complex64::new(1.0, 2.0)]);
        assert!(problem(complex("x").wrap()).contains("\"x_real\""));
        check_storable(&complex("y").wrap()).expect("other names");
    }
}
