//! Numbers of several motions side by side, one a lane of the processor's vector units.

use std::ops::{Add, Mul, Sub};

/// Motions that are simulated side by side: enough that one's step need not wait for the step before.
pub(in crate::diagnosis) const LANES: usize = 8;

/// One number of each motion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Lane(pub [f64; LANES]);

impl Default for Lane {
    fn default() -> Self {
        Self::splat(0.0)
    }
}

impl Lane {
    /// The same number for all.
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// Each motion's number.
    #[inline(always)]
    pub fn of(value: impl Fn(usize) -> f64) -> Self {
        let mut lane = [0.0; LANES];
        for (l, to) in lane.iter_mut().enumerate() {
            *to = value(l);
        }
        Self(lane)
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::of(|l| self.0[l].abs())
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self::of(|l| self.0[l].sqrt())
    }
}

impl Add for Lane {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::of(|l| self.0[l] + other.0[l])
    }
}

impl Sub for Lane {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::of(|l| self.0[l] - other.0[l])
    }
}

impl Mul for Lane {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::of(|l| self.0[l] * other.0[l])
    }
}
