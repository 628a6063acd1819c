//! From the last fit to what is handed out.

use faer::Mat;

use super::estimate::Ringdown;
use super::fitted::Fitted;
use super::freedom::parameter;
use super::knowledge::{Knowledge, Known, Quantity};
use super::modal_form::{EventParameters, shared};
use super::noise::RingdownNoise;
use super::noise_estimate::residuals;
use super::normal::Freedom;
use super::records::Records;
use super::search::Point;
use super::whittle::{expected_parts, hann};
use crate::model::ModelError;
use crate::signal::mean_periodogram;

/// Events below which their scatter says too little.
const SANDWICH_EVENTS: usize = 8;

impl Fitted {
    pub(super) fn result(
        self,
        records: &Records<'_>,
        point: Point,
        noise: RingdownNoise,
        freedom: &Freedom,
        known: &[Known],
    ) -> Result<Ringdown, ModelError> {
        let (samples, interval_s) = (records.samples(), records.interval_s);
        let degrees = records.observed().saturating_sub(self.used(freedom)).max(1);
        let total = shared(&point.exponentials).len();
        let spread = |inner: &Mat<f64>| {
            let mut full = Mat::<f64>::zeros(total, total);
            for (i, &p) in freedom.shared.iter().enumerate() {
                for (j, &q) in freedom.shared.iter().enumerate() {
                    full[(p, q)] = inner[(i, j)];
                }
            }
            freedom.of_parts(full, &point.exponentials)
        };
        let sandwich = (self.blocks.len() >= SANDWICH_EVENTS).then(|| {
            let n = freedom.shared.len();
            let mut scores = Mat::<f64>::zeros(n, n);
            let count = self.blocks.len() as f64;
            for block in &self.blocks {
                for i in 0..n {
                    for j in 0..n {
                        scores[(i, j)] += block.eliminated.score[i] * block.eliminated.score[j] * count / (count - 1.0);
                    }
                }
            }
            spread(&(&self.covariance * scores * &self.covariance))
        });
        let taper = hann(samples);
        let mut expected = vec![0.0; samples / 2 + 1];
        for (part, variance) in
            expected_parts(&noise, interval_s, &records.gaps.lag_weights(&taper)).iter().zip(noise.variances())
        {
            expected.iter_mut().zip(part).for_each(|(e, p)| *e += variance * p);
        }
        let absorbed = self.absorbed(&point.exponentials, freedom, records, &taper);
        expected.iter_mut().zip(absorbed).for_each(|(e, a)| *e = (*e - a).max(0.0));
        let residual_periodogram = mean_periodogram(&residuals(records, &point, &taper), &taper);
        let density = |values: Vec<f64>| values.into_iter().map(|v| 2.0 * interval_s * v).collect::<Vec<f64>>();
        let values = freedom.values(&point.exponentials);
        let edges = freedom.edges(&values);
        let on_edge = |quantity: &Quantity| {
            let parameter = parameter(*quantity, &point.exponentials);
            freedom.shared.iter().zip(&edges).any(|(p, edge)| Some(*p) == parameter && *edge != 0)
        };
        let fixed = known.iter().filter(|k| matches!(k.knowledge, Knowledge::Fixed(_))).map(|k| k.quantity).collect();
        Ok(Ringdown {
            on_bound: known.iter().map(|k| k.quantity).filter(on_edge).collect(),
            fixed,
            bootstrap: Vec::new(),
            event_std: self.event_std(freedom),
            frequency_hz: (0..=samples / 2).map(|k| k as f64 / (samples as f64 * interval_s)).collect(),
            residual_periodogram: density(residual_periodogram),
            expected_periodogram: density(expected),
            covariance: spread(&self.covariance),
            sandwich,
            reduced_chi_square: self.chi_square() / degrees as f64,
            freedom: degrees,
            noise,
            verdict: self.verdict,
            exponentials: point.exponentials,
            events: point.events,
        })
    }

    /// Standard errors of the events' own parameters, those of the shared ones included.
    fn event_std(&self, freedom: &Freedom) -> Vec<EventParameters> {
        self.blocks
            .iter()
            .map(|block| {
                let mut std = [0.0; 4];
                let shared = &block.eliminated.coupling * &self.covariance * block.eliminated.coupling.transpose();
                for (k, &parameter) in freedom.own.iter().enumerate() {
                    std[parameter] = (block.eliminated.own_inverse[(k, k)] + shared[(k, k)]).max(0.0).sqrt();
                }
                EventParameters { amplitude: std[0], onset_s: std[1], offset: std[2], slope: std[3] }
            })
            .collect()
    }
}
