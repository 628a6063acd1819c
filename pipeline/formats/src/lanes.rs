//! Which samples of an array make a channel.

/// A channel of fewer samples identifies nothing: an array of at most this many rows and as many times more columns is
/// wide.
const FEW: usize = 16;

/// How an array falls into channels. All distances count elements.
#[derive(Debug, PartialEq)]
pub struct Lanes {
    /// Samples of each channel.
    pub samples: usize,
    /// From one sample to the next.
    pub step: u64,
    /// Whether the last axis of a wide two-dimensional array was taken for time.
    pub wide: bool,
    others: Vec<(usize, u64)>,
}

impl Lanes {
    /// Finds the axis of time: axes of length 1 do not count; of one axis left it is that one; of more it is the first,
    /// as in `plot`, `filter`, `fft` of MATLAB and the columns of `numpy.loadtxt`; but of two it is the second if the
    /// array has at most 16 rows and at least 16 times as many columns, because 16 samples are no recording.
    ///
    /// None if a size is 0 or the number of elements overflows.
    pub fn of(shape: &[usize], first_axis_fastest: bool) -> Option<Self> {
        let axes = strided(shape, first_axis_fastest)?;
        let (&(rows, down), others) = axes.split_first().unwrap_or((&(1, 1), &[]));
        match others {
            &[(columns, across)] if rows <= FEW && columns >= FEW.saturating_mul(rows) => {
                Some(Self { samples: columns, step: across, wide: true, others: vec![(rows, down)] })
            }
            _ => Some(Self { samples: rows, step: down, wide: false, others: others.to_vec() }),
        }
    }

    /// As the file's program has it: time is the first axis however long it is, neighbours along the last are neighbours
    /// in the file.
    ///
    /// None if there is no axis, a size is 0, or the number of elements overflows.
    pub fn down(shape: &[usize]) -> Option<Self> {
        let (&samples, others) = shape.split_first()?;
        let axes = strided(others, false)?;
        let step = others.iter().try_fold(1_u64, |step, &size| step.checked_mul(size as u64))?;
        step.checked_mul(samples as u64).filter(|&elements| elements > 0)?;
        Some(Self { samples, step, wide: false, others: axes })
    }

    /// Number of channels.
    pub fn count(&self) -> usize {
        self.others.iter().map(|&(size, _)| size).product()
    }

    /// Index (`[2]`, `[2,3]`, empty for the only one), counted from `base`, and first element of each channel; the
    /// first index changes fastest.
    pub fn each(&self, base: usize) -> impl Iterator<Item = (String, u64)> {
        (0..self.count()).map(move |number| {
            let (mut left, mut first, mut index) = (number, 0, Vec::new());
            for &(size, step) in &self.others {
                first += (left % size) as u64 * step;
                index.push((left % size + base).to_string());
                left /= size;
            }
            (if index.is_empty() { String::new() } else { format!("[{}]", index.join(",")) }, first)
        })
    }
}

/// Size and distance of each axis longer than 1.
fn strided(shape: &[usize], first_axis_fastest: bool) -> Option<Vec<(usize, u64)>> {
    let mut step = 1_u64;
    let mut axes = Vec::new();
    let mut add = |&size: &usize| {
        if size > 1 {
            axes.push((size, step));
        }
        step = step.checked_mul(size as u64).filter(|&elements| elements > 0)?;
        Some(())
    };
    if first_axis_fastest {
        shape.iter().try_for_each(&mut add)?;
    } else {
        shape.iter().rev().try_for_each(&mut add)?;
        axes.reverse();
    }
    Some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lanes(shape: &[usize], fortran: bool) -> (usize, u64, bool, Vec<(String, u64)>) {
        let lanes = Lanes::of(shape, fortran).unwrap();
        (lanes.samples, lanes.step, lanes.wide, lanes.each(1).collect())
    }

    #[test]
    fn vectors_are_one_channel_however_they_lie() {
        for shape in [&[40][..], &[1, 40], &[40, 1], &[1, 40, 1]] {
            assert_eq!(lanes(shape, true), (40, 1, false, vec![(String::new(), 0)]), "{shape:?}");
        }
    }

    #[test]
    fn columns_are_channels() {
        let two = |step| vec![("[1]".to_owned(), 0), ("[2]".to_owned(), step)];
        assert_eq!(lanes(&[40, 2], true), (40, 1, false, two(40)));
        assert_eq!(lanes(&[40, 2], false), (40, 2, false, two(1)));
    }

    #[test]
    fn rows_of_a_wide_array_are_channels() {
        let two = |step| vec![("[1]".to_owned(), 0), ("[2]".to_owned(), step)];
        assert_eq!(lanes(&[2, 32], true), (32, 2, true, two(1)));
        assert_eq!(lanes(&[2, 32], false), (32, 1, true, two(32)));
        assert!(!Lanes::of(&[2, 31], true).unwrap().wide);
        assert!(!Lanes::of(&[17, 9000], true).unwrap().wide);
    }

    #[test]
    fn indices_of_more_axes_count_the_first_fastest() {
        let (samples, step, _, each) = lanes(&[2, 3, 2], true);
        assert_eq!((samples, step), (2, 1));
        let indices: Vec<_> = each.iter().map(|(index, first)| (index.as_str(), *first)).collect();
        assert_eq!(indices, [("[1,1]", 0), ("[2,1]", 2), ("[3,1]", 4), ("[1,2]", 6), ("[2,2]", 8), ("[3,2]", 10)]);
    }

    #[test]
    fn nothing_comes_of_empty_or_endless_arrays() {
        assert_eq!(Lanes::of(&[0, 5], true), None);
        assert_eq!(Lanes::of(&[usize::MAX, 5], false), None);
        assert_eq!(Lanes::of(&[], false).unwrap().samples, 1);
    }

    #[test]
    fn time_is_the_first_axis_where_the_program_says_so() {
        let down = |shape: &[usize]| {
            let lanes = Lanes::down(shape)?;
            Some((lanes.samples, lanes.step, lanes.each(0).collect::<Vec<_>>()))
        };
        let named =
            |names: &[(&str, u64)]| names.iter().map(|(name, at)| ((*name).to_owned(), *at)).collect::<Vec<_>>();
        assert_eq!(down(&[1, 3]), Some((1, 3, named(&[("[0]", 0), ("[1]", 1), ("[2]", 2)]))));
        assert_eq!(down(&[5]), Some((5, 1, named(&[("", 0)]))));
        assert_eq!(down(&[5, 1]), Some((5, 1, named(&[("", 0)]))));
        assert_eq!((down(&[]), down(&[0, 3]), down(&[4, 0]), down(&[usize::MAX, 3])), (None, None, None, None));
    }
}
