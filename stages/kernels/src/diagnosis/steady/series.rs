//! What is left of the record before and after the named causes.

use crate::c64;

use super::choice::Judged;
use super::findings::Findings;
use super::lines::take_off;

impl Findings<'_> {
    /// The record less level and fundamental, and less the named curve and lines, in the signal's unit.
    pub fn series(&self, named: Option<&Judged>) -> (Vec<f64>, Vec<f64>) {
        let mut before = Vec::with_capacity(self.track.phase.len());
        let mut after = Vec::with_capacity(self.track.phase.len());
        for (b, block) in self.blocks.blocks.iter().enumerate() {
            let first = block.harmonics.get(1).map_or(0.0, |h| h.re);
            let predicted = named.map_or(Vec::new(), |judged| self.measured.predicted(&judged.fitted, b));
            let motion = self.track.stretch(&block.range);
            let values = self.values.iter().skip(self.track.first + block.range.start);
            for (y, (phase, amplitude)) in values.zip(motion) {
                let step = c64::from_polar(amplitude, phase + block.turn);
                let fundamental = y - first * step.re;
                let mut turn = step;
                let mut curve = 0.0;
                for h in predicted.iter().skip(1) {
                    turn *= step;
                    curve += h * turn.re;
                }
                before.push(fundamental);
                after.push(fundamental - curve);
            }
        }
        for family in self.named_families() {
            for (line, parts) in &family.parts {
                take_off(&mut after, line.frequency, *parts);
            }
        }
        let units = |series: Vec<f64>| series.into_iter().map(|v| v * self.scale).collect();
        (units(before), units(after))
    }
}
