//! Equations of motion, integrated; and what frequency and damping are at an amplitude.

use std::f64::consts::{PI, TAU};

/// An oscillator: `x'' + spring + c v + cq |v| v + coul sign(v) = 0`.
#[derive(Clone, Copy, Default)]
pub struct System {
    pub w: f64,
    pub c: f64,
    pub cq: f64,
    /// Share of the stiffness that goes with the squared deflection.
    pub k3: f64,
    pub coul: f64,
    /// Spring of power 1 + eps.
    pub eps: f64,
    /// Half the play: no force up to there.
    pub play: f64,
    pub pendulum: bool,
}

impl System {
    /// Whether it is not linear.
    pub fn moves(&self) -> bool {
        self.k3 != 0.0 || self.cq != 0.0 || self.coul != 0.0 || self.eps != 0.0 || self.play != 0.0 || self.pendulum
    }

    fn spring(&self, x: f64) -> f64 {
        let w2 = self.w * self.w;
        if self.pendulum {
            w2 * x.sin()
        } else if self.eps != 0.0 {
            w2 * x * x.abs().max(1e-12).powf(self.eps)
        } else if self.play != 0.0 {
            w2 * (x.abs() - self.play).max(0.0) * x.signum()
        } else {
            w2 * (x + self.k3 * x.powi(3))
        }
    }

    fn potential(&self, x: f64) -> f64 {
        let w2 = self.w * self.w;
        if self.pendulum {
            w2 * 2.0 * (0.5 * x).sin().powi(2)
        } else if self.eps != 0.0 {
            w2 * x.abs().powf(2.0 + self.eps) / (2.0 + self.eps)
        } else if self.play != 0.0 {
            0.5 * w2 * (x.abs() - self.play).max(0.0).powi(2)
        } else {
            w2 * (0.5 * x * x + 0.25 * self.k3 * x.powi(4))
        }
    }

    /// The free motion from rest at `x0`: n samples at rate `fs`, Runge and Kutta's method in `sub` steps each.
    pub fn run(&self, n: usize, fs: f64, sub: usize, x0: f64) -> Vec<f64> {
        let h = 1.0 / fs / sub as f64;
        let (mut x, mut v) = (x0, 0.0_f64);
        let force = |x: f64, v: f64| {
            let dry = if self.coul > 0.0 { self.coul * (v / (1e-3 * self.w)).tanh() } else { 0.0 };
            -self.spring(x) - self.c * v - self.cq * v.abs() * v - dry
        };
        let mut y = Vec::with_capacity(n);
        for _ in 0..n {
            y.push(x);
            for _ in 0..sub {
                let (k1x, k1v) = (v, force(x, v));
                let (k2x, k2v) = (v + 0.5 * h * k1v, force(x + 0.5 * h * k1x, v + 0.5 * h * k1v));
                let (k3x, k3v) = (v + 0.5 * h * k2v, force(x + 0.5 * h * k2x, v + 0.5 * h * k2v));
                let (k4x, k4v) = (v + h * k3v, force(x + h * k3x, v + h * k3v));
                x += h / 6.0 * (k1x + 2.0 * k2x + 2.0 * k3x + k4x);
                v += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v);
            }
        }
        y
    }

    /// Period, fundamental amplitude and energy lost per period at peak amplitude xm.
    fn orbit(&self, xm: f64) -> (f64, f64, f64) {
        let e = self.potential(xm);
        let n = 400;
        let mut quarter = 0.0;
        let mut lost = 0.0;
        let mut times = vec![];
        for i in 0..n {
            let th = (i as f64 + 0.5) / n as f64 * PI / 2.0;
            let x = xm * th.sin();
            let v = (2.0 * (e - self.potential(x))).max(0.0).sqrt();
            let dx = xm * th.cos() * PI / 2.0 / n as f64;
            let dt = dx / v;
            times.push((quarter + 0.5 * dt, x, dt));
            quarter += dt;
            lost += 4.0 * dx * (self.c * v + self.cq * v * v + self.coul);
        }
        let period = 4.0 * quarter;
        let a1 = 8.0 / period * times.iter().map(|(t, x, dt)| x * (TAU * t / period).sin() * dt).sum::<f64>();
        (period, a1, lost)
    }

    /// Frequency and damping ratio at a fundamental amplitude.
    pub fn local(&self, a: f64) -> (f64, f64) {
        let mut xm = a;
        for _ in 0..6 {
            xm *= a / self.orbit(xm).1;
        }
        let (period, a1, lost) = self.orbit(xm);
        let d = 1e-3;
        let slope = (self.orbit(xm * (1.0 + d)).1 - self.orbit(xm * (1.0 - d)).1) / (2.0 * d * xm);
        let g = slope * lost / period / self.spring(xm) / a1;
        (1.0 / period, g / (TAU / period))
    }
}
