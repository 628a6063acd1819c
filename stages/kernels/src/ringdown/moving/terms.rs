//! Terms of the laws by which frequency and decay rate go with the amplitude.

/// A function of the relative amplitude `a`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Term {
    /// 1: a linear mode.
    One,
    /// `a`: quadratic drag (in the decay rate).
    Linear,
    /// `a^2`: cubic spring, sine of an angle (in the frequency); cubic damping.
    Square,
    /// `a^4`: the next order of both.
    Fourth,
    /// `log a`: spring of a power law near 1, slip.
    Log,
    /// `1/a`: dry friction (in the decay rate), play (in the frequency).
    Inverse,
}

/// Number of terms.
pub const TERMS: usize = 6;
/// All of them, in the order of [`values`].
pub const ALL: [Term; TERMS] = [Term::One, Term::Linear, Term::Square, Term::Fourth, Term::Log, Term::Inverse];

impl Term {
    /// Its place in the list of all terms.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// Values of all terms, and their first and second derivatives by `log a`.
#[derive(Debug, Clone, Copy)]
pub struct Values {
    /// Values.
    pub value: [f64; TERMS],
    /// First derivatives.
    pub first: [f64; TERMS],
    /// Second derivatives.
    pub second: [f64; TERMS],
}

/// All terms at a relative amplitude.
///
/// `floor`: relative amplitude below which `log a` and `1/a` level off, `a -> sqrt(a^2 + floor^2)`, so that dry
/// friction ends in an exponential decay far below the noise instead of a singular point.
pub fn values(a: f64, floor: f64) -> Values {
    let square = a * a;
    let above = square + floor * floor;
    let share = square / above;
    let inverse = 1.0 / above.sqrt();
    let fourth = square * square;
    let bend = 2.0 * share * (1.0 - share);
    Values {
        value: [1.0, a, square, fourth, 0.5 * above.ln(), inverse],
        first: [0.0, a, 2.0 * square, 4.0 * fourth, share, -share * inverse],
        second: [0.0, a, 4.0 * square, 16.0 * fourth, bend, (share * share - bend) * inverse],
    }
}

/// A sum of terms.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Law {
    /// Terms, ascending.
    pub terms: Vec<Term>,
    /// Their coefficients, rad/s or 1/s.
    pub coefficients: Vec<f64>,
}

impl Law {
    /// One term, the constant.
    pub fn constant(value: f64) -> Self {
        Self { terms: vec![Term::One], coefficients: vec![value] }
    }

    /// No term: zero, and nothing to be fitted.
    pub fn zero() -> Self {
        Self::default()
    }

    /// How many terms beside the constant.
    pub fn terms_that_move(&self) -> usize {
        self.terms.iter().filter(|&&t| t != Term::One).count()
    }

    /// Its value where the terms have these.
    pub fn at(&self, terms: &[f64; TERMS]) -> f64 {
        self.terms.iter().zip(&self.coefficients).map(|(t, c)| c * terms[t.index()]).sum()
    }

    /// Whether it depends on the amplitude.
    pub fn moves(&self) -> bool {
        self.terms_that_move() > 0
    }

    /// With one term more, coefficient zero.
    pub fn with(&self, term: Term) -> Self {
        let mut law = self.clone();
        let place = law.terms.iter().position(|&t| t > term).unwrap_or(law.terms.len());
        law.terms.insert(place, term);
        law.coefficients.insert(place, 0.0);
        law
    }

    /// Without a term.
    pub fn without(&self, term: Term) -> Self {
        let pairs = self.terms.iter().zip(&self.coefficients).filter(|(t, _)| **t != term);
        let (terms, coefficients) = pairs.map(|(t, c)| (*t, *c)).unzip();
        Self { terms, coefficients }
    }
}
