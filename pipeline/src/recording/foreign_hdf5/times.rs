//! Which axis of a two-dimensional dataset is time, where arrays of times lie beside it.

use std::collections::HashMap;

use afmid_formats::names_times;

use super::walk::Found;

/// Lengths of arrays of times by the path of their group.
#[derive(Debug, Default)]
pub(super) struct Times(HashMap<String, Vec<usize>>);

impl Times {
    /// Looks at names and shapes alone.
    pub(super) fn of(found: &[Found]) -> Self {
        let mut times = Self::default();
        for found in found.iter().filter(|found| names_times(&found.name)) {
            let shape = found.dataset.get_shape().unwrap_or_default();
            let length: usize = shape.iter().product();
            if length > 1 && shape.iter().filter(|size| **size > 1).count() == 1 {
                times.0.entry(found.group.clone()).or_default().push(length);
            }
        }
        times
    }

    /// Whether the first axis of a dataset of this shape is time: it is as long as times in its group or around it, and
    /// the other is not.
    pub(super) fn first_axis(&self, group: &str, shape: &[usize]) -> bool {
        let &[rows, columns] = shape else { return false };
        let mut path = Some(group);
        while let Some(here) = path {
            let lengths = self.0.get(here).map(Vec::as_slice).unwrap_or_default();
            if lengths.contains(&rows) || lengths.contains(&columns) {
                return !lengths.contains(&columns);
            }
            path = here.rfind('/').and_then(|cut| here.get(..cut));
        }
        false
    }
}
