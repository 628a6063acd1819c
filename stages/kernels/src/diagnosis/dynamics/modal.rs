//! Dynamics as a sum of sections: modes, free masses, real poles.

use serde::{Deserialize, Serialize};

use super::model::State;
use super::section::Section;
use super::sensed::Sensed;

/// Which weights of the sections in the outputs are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weights {
    /// None: one output that senses the sum of the motions.
    Fixed,
    /// Those of the rates (of the deflections where the output is a rate): one output of any linear system, whose zeros
    /// may lie anywhere.
    Rates,
    /// Both, in every channel but a section's own.
    Shapes,
}

/// `y_c = sum_s w_cs . x_s + through u`, x_s = (deflection, rate / omega) of section s; an accelerometer has `- q'' /
/// omega^2` in the place of the deflection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modal {
    /// Modes first, then real poles.
    pub sections: Vec<Section>,
    /// By channel and section.
    pub weights: Vec<Vec<[f64; 2]>>,
    /// Which of them are estimated.
    pub free: Weights,
    /// The channel of each section whose weights are given: its unit.
    pub own: Vec<usize>,
    /// What each channel senses.
    pub sensed: Vec<Sensed>,
    /// Direct feedthrough of the input, none where there is none.
    pub through: Option<f64>,
    /// Whether gains count: false where there is no input.
    pub driven: bool,
    /// Whether each stretch and channel has an offset of its own.
    pub offsets: bool,
    /// Interval of the samples, s.
    pub interval_s: f64,
}

impl Modal {
    /// One output that senses the sum of its sections' motions.
    pub fn sum(sections: Vec<Section>, sensed: Sensed, driven: bool, interval_s: f64) -> Self {
        // a relaxation has no rate: it is seen as it is
        let weights = |section: &Section| if section.is_mode() { sensed.weights() } else { [1.0, 0.0] };
        let (weights, own) = (vec![sections.iter().map(weights).collect()], vec![0; sections.len()]);
        let (free, sensed) = (Weights::Fixed, vec![sensed]);
        Self { sections, weights, free, own, sensed, through: None, driven, offsets: false, interval_s }
    }

    /// Whether it is one oscillator seen by its deflection.
    pub(crate) fn is_oscillator(&self) -> bool {
        self.sections.len() == 1 && self.modes() == 1 && self.free == Weights::Fixed && self.through.is_none()
    }

    /// Some of its sections, in their order.
    pub(crate) fn of(&self, sections: &[usize]) -> Self {
        let mut modal = self.clone();
        modal.sections = sections.iter().map(|s| self.sections[*s]).collect();
        modal.own = sections.iter().map(|s| self.own[*s]).collect();
        modal.weights = self.weights.iter().map(|weights| sections.iter().map(|s| weights[*s]).collect()).collect();
        modal
    }

    /// Poles.
    pub fn order(&self) -> usize {
        self.sections.iter().map(Section::order).sum()
    }

    /// Sections that are modes.
    pub fn modes(&self) -> usize {
        self.sections.iter().filter(|section| section.is_mode()).count()
    }

    /// Highest frequency, Hz.
    pub fn highest_hz(&self) -> f64 {
        self.sections.iter().filter(|section| section.is_mode()).map(|s| s.frequency_hz).fold(0.0, f64::max)
    }

    /// Lowest frequency, Hz.
    pub fn lowest_hz(&self) -> f64 {
        self.sections.iter().map(|s| s.frequency_hz).fold(f64::INFINITY, f64::min)
    }

    /// The weight of one output that is not given.
    pub(crate) fn other_part(&self) -> usize {
        usize::from(self.sensed.first() != Some(&Sensed::Rate))
    }

    fn is_free(&self, channel: usize, section: usize, part: usize) -> bool {
        match self.free {
            Weights::Fixed => false,
            Weights::Rates => part == self.other_part() && self.sections[section].is_mode(),
            Weights::Shapes => channel != self.own[section] && part < self.sections[section].order(),
        }
    }

    /// Its numbers, section by section, then weights, then the feedthrough.
    pub(super) fn vector(&self) -> Vec<f64> {
        let mut vector: Vec<f64> = self.sections.iter().flat_map(|section| section.vector(self.driven)).collect();
        for (channel, weights) in self.weights.iter().enumerate() {
            for (section, weight) in weights.iter().enumerate() {
                vector.extend((0..2).filter(|part| self.is_free(channel, section, *part)).map(|part| weight[part]));
            }
        }
        vector.extend(self.through);
        vector
    }

    /// The same at other numbers.
    pub(super) fn at(&self, next: &mut impl Iterator<Item = f64>) -> Self {
        let mut modal = self.clone();
        modal.sections = self.sections.iter().map(|s| s.at(next, self.driven, self.interval_s)).collect();
        for channel in 0..self.weights.len() {
            for section in 0..self.sections.len() {
                for part in (0..2).filter(|part| self.is_free(channel, section, *part)) {
                    let weight = &mut modal.weights[channel][section][part];
                    *weight = next.next().unwrap_or(*weight);
                }
            }
        }
        if let Some(through) = &mut modal.through {
            *through = next.next().unwrap_or(*through);
        }
        modal
    }

    /// Place of a section's numbers in [`Self::vector`].
    pub(crate) fn place(&self, section: usize) -> usize {
        self.sections.iter().take(section).map(|section| section.vector(self.driven).len()).sum()
    }

    /// The state of a stretch that begins at rest.
    pub(crate) fn at_rest(&self) -> State {
        let offsets = if self.offsets { vec![0.0; self.weights.len()] } else { Vec::new() };
        State { sections: vec![[0.0; 2]; self.sections.len()], offsets }
    }

    /// Numbers of a stretch's own: state, offsets.
    pub(super) fn own_numbers(&self) -> usize {
        self.order() + if self.offsets { self.weights.len() } else { 0 }
    }
}
