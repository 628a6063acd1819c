//! What a signal passes through: maps of single values, and paths that depend on the time or on what came before.

use std::fmt;
use std::sync::Arc;

/// A map of single values.
pub type StaticMap = Arc<dyn Fn(f64) -> f64 + Send + Sync>;
/// A change of a whole signal: its times since the record's first sample, s, which never fall, and its values in that
/// order, replaced by what comes out.
pub type SignalPath = Arc<dyn Fn(&[f64], &mut [f64]) + Send + Sync>;

/// One thing that a signal passes through.
#[derive(Clone)]
pub enum Passage {
    /// A map: what comes out depends on nothing but the value.
    Map(StaticMap),
    /// A path: what comes out depends on the time or on what came before.
    Path(SignalPath),
}

impl Passage {
    /// A map of single values.
    pub fn map(map: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::Map(Arc::new(map))
    }

    /// A change of a signal in order.
    pub fn path(path: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static) -> Self {
        Self::Path(Arc::new(path))
    }

    /// Whether it is another's clone.
    pub(super) fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Map(own), Self::Map(other)) => Arc::ptr_eq(own, other),
            (Self::Path(own), Self::Path(other)) => Arc::ptr_eq(own, other),
            _ => false,
        }
    }

    /// Whether it depends on more than the value.
    pub fn is_path(&self) -> bool {
        matches!(self, Self::Path(_))
    }
}

impl fmt::Debug for Passage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_path() { "Path" } else { "Map" })
    }
}

/// A signal through all of them in their order; `time_s` gives the time of a value by its place.
pub fn pass(passages: &[Passage], time_s: impl Fn(usize) -> f64, values: &mut [f64]) {
    let paths = passages.iter().any(Passage::is_path);
    let times: Vec<f64> = if paths { (0..values.len()).map(time_s).collect() } else { Vec::new() };
    for passage in passages {
        match passage {
            Passage::Map(map) => values.iter_mut().for_each(|value| *value = map(*value)),
            Passage::Path(path) => path(&times, values),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_passes_in_order() {
        let sum = Passage::path(|_, values| {
            let mut sum = 0.0;
            values.iter_mut().for_each(|value| {
                sum += *value;
                *value = sum;
            });
        });
        let late = Passage::path(|times, values| values.iter_mut().zip(times).for_each(|(v, t)| *v *= t));
        let square = Passage::map(|v| v * v);
        let through = |passages: &[Passage]| {
            let mut values = vec![1.0, 2.0, 3.0];
            pass(passages, |k| k as f64, &mut values);
            values
        };
        assert_eq!(through(&[sum.clone(), square.clone()]), [1.0, 9.0, 36.0]);
        assert_eq!(through(&[square, sum]), [1.0, 5.0, 14.0]);
        assert_eq!(through(&[late]), [0.0, 2.0, 6.0]);
        assert_eq!(through(&[]), [1.0, 2.0, 3.0]);
    }
}
