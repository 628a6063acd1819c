//! A force as a formula of one mode's motion: laws that are stated while the program runs.

/// What an operation does with one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unary {
    /// -a.
    Negative,
    /// |a|.
    Absolute,
    /// -1, 0 or 1.
    Sign,
    /// The square root.
    Sqrt,
    /// The cube root.
    Cbrt,
    /// a a.
    Square,
    /// 1 / a.
    Reciprocal,
    /// e^a.
    Exp,
    /// e^a - 1.
    Expm1,
    /// The natural logarithm.
    Log,
    /// log(1 + a).
    Log1p,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Inverse sine.
    Arcsin,
    /// Inverse cosine.
    Arccos,
    /// Inverse tangent.
    Arctan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// The largest whole number that is not above.
    Floor,
    /// The smallest whole number that is not below.
    Ceil,
    /// 1 of 0, else 0.
    Not,
}

/// What an operation does with two numbers. Comparisons give 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binary {
    /// a + b.
    Add,
    /// a - b.
    Subtract,
    /// a b.
    Multiply,
    /// a / b.
    Divide,
    /// a^b.
    Power,
    /// The remainder of a / b with the sign of b.
    Remainder,
    /// The larger.
    Maximum,
    /// The smaller.
    Minimum,
    /// sqrt(a a + b b).
    Hypot,
    /// The angle of (b, a).
    Arctan2,
    /// |a| with the sign of b.
    Copysign,
    /// 0 below 0, b at 0, 1 above.
    Heaviside,
    /// a > b.
    Greater,
    /// a >= b.
    GreaterEqual,
    /// a < b.
    Less,
    /// a <= b.
    LessEqual,
    /// a = b.
    Equal,
    /// a is not b.
    NotEqual,
    /// Both are not 0.
    And,
    /// One is not 0.
    Or,
}

/// An operation on results of earlier ones, by their places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operation {
    /// The mode's deflection q.
    Deflection,
    /// Its rate q' / omega.
    Rate,
    /// A number.
    Number(f64),
    /// Of one result.
    Unary(Unary, usize),
    /// Of two.
    Binary(Binary, usize, usize),
    /// The second where the first is not 0, else the third.
    Choose(usize, usize, usize),
}

/// A formula of a mode's deflection and rate.
///
/// # Model
/// A list of operations, each on results of those before it; the last one's result is the formula's value.
/// # Units
/// Deflection and rate / omega in one unit.
/// # Accuracy
/// That of the processor's and the system's functions: the last bits may differ from another library's.
/// # Cost
/// Some nanoseconds an operation. What depends on no motion is computed once.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    steps: Vec<Step>,
    result: Operand,
}

/// Where a number comes from: it is known, or in a register. Registers 0 and 1 hold deflection and rate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Operand {
    Number(f64),
    Register(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Unary(Unary, Operand),
    Binary(Binary, Operand, Operand),
    /// To a whole power.
    Powi(Operand, i32),
    Choose(Operand, Operand, Operand),
}

/// Most operations: far more than a law on paper has.
pub const MOST_OPERATIONS: usize = 1000;
/// Registers without memory of the heap; those of almost any law.
const FEW: usize = 32;
/// Largest whole power that is a product.
const MOST_POWER: f64 = 16.0;

impl Formula {
    /// Errors, in words: no operation, more than [`MOST_OPERATIONS`], one on a result that is not before it.
    pub fn new(operations: &[Operation]) -> Result<Self, String> {
        let count = operations.len();
        if count == 0 || count > MOST_OPERATIONS {
            return Err(format!("a formula of {count} operations, wanted 1 to {MOST_OPERATIONS}"));
        }
        let mut steps: Vec<Step> = Vec::new();
        let mut known: Vec<Operand> = Vec::with_capacity(count);
        for operation in operations {
            let of = |place: usize| {
                known.get(place).copied().ok_or_else(|| format!("operation {} is of a later result", known.len()))
            };
            let step = match *operation {
                Operation::Deflection => {
                    known.push(Operand::Register(0));
                    continue;
                }
                Operation::Rate => {
                    known.push(Operand::Register(1));
                    continue;
                }
                Operation::Number(number) => {
                    known.push(Operand::Number(number));
                    continue;
                }
                Operation::Unary(unary, a) => Step::Unary(unary, of(a)?),
                Operation::Binary(Binary::Power, a, b) => match of(b)? {
                    Operand::Number(b) if b == b.trunc() && b.abs() <= MOST_POWER => Step::Powi(of(a)?, b as i32),
                    b => Step::Binary(Binary::Power, of(a)?, b),
                },
                Operation::Binary(binary, a, b) => Step::Binary(binary, of(a)?, of(b)?),
                Operation::Choose(a, b, c) => Step::Choose(of(a)?, of(b)?, of(c)?),
            };
            if step.is_known() {
                known.push(Operand::Number(step.value(&[])));
                continue;
            }
            // what was computed before is not computed twice
            let same = steps.iter().position(|other| *other == step);
            known.push(Operand::Register(2 + same.unwrap_or(steps.len())));
            if same.is_none() {
                steps.push(step);
            }
        }
        let result = known.last().copied().unwrap_or(Operand::Number(0.0));
        Ok(Self { steps, result })
    }

    /// Its value at a deflection and rate / omega.
    pub fn at(&self, deflection: f64, rate: f64) -> f64 {
        let count = 2 + self.steps.len();
        if count <= FEW {
            self.within(&mut [0.0; FEW], deflection, rate)
        } else {
            self.within(&mut vec![0.0; count], deflection, rate)
        }
    }

    fn within(&self, registers: &mut [f64], deflection: f64, rate: f64) -> f64 {
        registers[0] = deflection;
        registers[1] = rate;
        for (place, step) in self.steps.iter().enumerate() {
            registers[2 + place] = step.value(registers);
        }
        self.result.value(registers)
    }
}

impl Operand {
    #[inline]
    fn value(self, registers: &[f64]) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Register(place) => registers[place],
        }
    }

    fn is_known(self) -> bool {
        matches!(self, Self::Number(_))
    }
}

impl Step {
    fn is_known(&self) -> bool {
        match *self {
            Self::Unary(_, a) | Self::Powi(a, _) => a.is_known(),
            Self::Binary(_, a, b) => a.is_known() && b.is_known(),
            Self::Choose(a, b, c) => a.is_known() && b.is_known() && c.is_known(),
        }
    }

    #[inline]
    fn value(&self, registers: &[f64]) -> f64 {
        match *self {
            Self::Unary(unary, a) => unary.of(a.value(registers)),
            Self::Binary(binary, a, b) => binary.of(a.value(registers), b.value(registers)),
            Self::Powi(a, power) => a.value(registers).powi(power),
            Self::Choose(a, b, c) => if a.value(registers) != 0.0 { b } else { c }.value(registers),
        }
    }
}

impl Unary {
    fn of(self, a: f64) -> f64 {
        match self {
            Self::Negative => -a,
            Self::Absolute => a.abs(),
            Self::Sign => {
                if a == 0.0 {
                    a
                } else {
                    a.signum()
                }
            }
            Self::Sqrt => a.sqrt(),
            Self::Cbrt => a.cbrt(),
            Self::Square => a * a,
            Self::Reciprocal => 1.0 / a,
            Self::Exp => a.exp(),
            Self::Expm1 => a.exp_m1(),
            Self::Log => a.ln(),
            Self::Log1p => a.ln_1p(),
            Self::Sin => a.sin(),
            Self::Cos => a.cos(),
            Self::Tan => a.tan(),
            Self::Arcsin => a.asin(),
            Self::Arccos => a.acos(),
            Self::Arctan => a.atan(),
            Self::Sinh => a.sinh(),
            Self::Cosh => a.cosh(),
            Self::Tanh => a.tanh(),
            Self::Floor => a.floor(),
            Self::Ceil => a.ceil(),
            Self::Not => flag(a == 0.0),
        }
    }
}

impl Binary {
    fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Power => a.powf(b),
            Self::Remainder => a - b * (a / b).floor(),
            // a missing number stays one
            Self::Maximum => {
                if a >= b || a.is_nan() {
                    a
                } else {
                    b
                }
            }
            Self::Minimum => {
                if a <= b || a.is_nan() {
                    a
                } else {
                    b
                }
            }
            Self::Hypot => a.hypot(b),
            Self::Arctan2 => a.atan2(b),
            Self::Copysign => a.copysign(b),
            Self::Heaviside => {
                if a == 0.0 {
                    b
                } else {
                    flag(a > 0.0)
                }
            }
            Self::Greater => flag(a > b),
            Self::GreaterEqual => flag(a >= b),
            Self::Less => flag(a < b),
            Self::LessEqual => flag(a <= b),
            Self::Equal => flag(a == b),
            Self::NotEqual => flag(a != b),
            Self::And => flag(a != 0.0 && b != 0.0),
            Self::Or => flag(a != 0.0 || b != 0.0),
        }
    }
}

fn flag(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_formula_is_its_value() {
        use Operation::{Binary as Two, Choose, Deflection, Number, Rate, Unary as One};
        // q^3 where q > v, else tanh(v / 2) + 1
        let operations = [
            Deflection,
            Rate,
            Number(3.0),
            Two(Binary::Power, 0, 2),
            Number(2.0),
            Two(Binary::Divide, 1, 4),
            One(Unary::Tanh, 5),
            Number(1.0),
            Two(Binary::Add, 6, 7),
            Two(Binary::Greater, 0, 1),
            Choose(9, 3, 8),
        ];
        let formula = Formula::new(&operations).unwrap();
        assert_eq!(formula.at(2.0, 1.0), 8.0);
        assert_eq!(formula.at(-1.0, 0.5), 0.25_f64.tanh() + 1.0);
    }

    #[test]
    fn what_depends_on_no_motion_is_computed_once() {
        let known = [Operation::Number(2.0), Operation::Unary(Unary::Square, 0)];
        let formula = Formula::new(&known).unwrap();
        assert!(formula.steps.is_empty());
        assert_eq!(formula.at(1.0, 1.0), 4.0);
        let twice = [
            Operation::Deflection,
            Operation::Unary(Unary::Square, 0),
            Operation::Unary(Unary::Square, 0),
            Operation::Binary(Binary::Add, 1, 2),
        ];
        assert_eq!(Formula::new(&twice).unwrap().steps.len(), 2);
    }

    #[test]
    fn what_is_no_formula_is_refused() {
        assert!(Formula::new(&[]).is_err());
        assert!(Formula::new(&[Operation::Unary(Unary::Exp, 0)]).is_err());
        assert!(Formula::new(&vec![Operation::Rate; MOST_OPERATIONS + 1]).is_err());
    }
}
