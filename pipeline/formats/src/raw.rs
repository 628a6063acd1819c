//! Samples as they are stored.

/// Raw samples of one stretch, as stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// 16-bit codes, as from an analog-to-digital converter (8-bit ones are widened).
    Int16(Vec<i16>),
    /// 32-bit codes (unsigned 16-bit ones are widened).
    Int32(Vec<i32>),
    /// Single precision.
    Float32(Vec<f32>),
    /// Double precision (unsigned 32-bit and 64-bit codes as well).
    Float64(Vec<f64>),
}

impl Raw {
    /// How many samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Int16(codes) => codes.len(),
            Self::Int32(codes) => codes.len(),
            Self::Float32(codes) => codes.len(),
            Self::Float64(codes) => codes.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends `stored * scale + offset` for every sample.
    pub fn scale_into(&self, scale: f64, offset: f64, out: &mut Vec<f64>) {
        match self {
            Self::Int16(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Int32(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Float32(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Float64(codes) => out.extend(codes.iter().map(|&code| code * scale + offset)),
        }
    }

    /// The stored numbers in double precision, which holds all of them exactly.
    pub fn widened(self) -> Vec<f64> {
        match self {
            Self::Int16(codes) => codes.into_iter().map(f64::from).collect(),
            Self::Int32(codes) => codes.into_iter().map(f64::from).collect(),
            Self::Float32(values) => values.into_iter().map(f64::from).collect(),
            Self::Float64(values) => values,
        }
    }

    /// These samples and then those of `later`: of the same type, or both in double precision.
    #[must_use]
    pub(crate) fn followed_by(self, later: Self) -> Self {
        match (self, later) {
            (Self::Int16(mut a), Self::Int16(b)) => Self::Int16({
                a.extend(b);
                a
            }),
            (Self::Int32(mut a), Self::Int32(b)) => Self::Int32({
                a.extend(b);
                a
            }),
            (Self::Float32(mut a), Self::Float32(b)) => Self::Float32({
                a.extend(b);
                a
            }),
            (a, b) => Self::Float64({
                let mut values = a.widened();
                values.extend(b.widened());
                values
            }),
        }
    }

    /// The same samples, the last one first.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        match &mut self {
            Self::Int16(codes) => codes.reverse(),
            Self::Int32(codes) => codes.reverse(),
            Self::Float32(values) => values.reverse(),
            Self::Float64(values) => values.reverse(),
        }
        self
    }
}
