//! A point of the search with everything known of it.

use std::sync::Arc;

use super::columns::Columns;
use super::jacobian::{Point, coefficient_jacobian, residual, to_coordinates};
use super::levenberg_marquardt::FIRST_DAMPING;
use super::predictor::Problem;
use super::projection::{Projection, Sensitivities};
use super::secant::Secant;
use super::whitening::Whitened;
use crate::model::ModelError;
use crate::optimise::Ending;

/// A point with everything known of it.
pub(crate) struct State {
    pub point: Point,
    /// The records through the point's whitening.
    pub signals: Arc<Whitened>,
    pub regressors: Columns,
    pub projection: Projection,
    pub gradient: f64,
    pub iterations: usize,
    pub ending: Ending,
    pub memory: Memory,
}

/// What a search leaves for the next one nearby.
#[derive(Clone)]
pub(crate) struct Memory {
    pub damping: f64,
    pub secant: Secant,
}

impl State {
    /// Evaluates a point. Errors: no finite prediction errors there.
    pub fn new(problem: &Problem, point: Point) -> Result<Self, ModelError> {
        let whitened = Self::whitening(problem, &point);
        Self::through(problem, point, whitened)
    }

    /// The records through a point's whitening.
    pub fn whitening(problem: &Problem, point: &Point) -> Arc<Whitened> {
        Arc::new(Whitened::new(&problem.experiments, point.whitening()))
    }

    /// The same, `known` where it is that: a whitening that stays is not computed again.
    pub fn whitened(problem: &Problem, point: &Point, known: Arc<Whitened>) -> Arc<Whitened> {
        if known.filter == point.whitening() { known } else { Self::whitening(problem, point) }
    }

    /// The point with other coordinates. Errors: no finite prediction errors there.
    pub fn moved(&self, problem: &Problem, coordinates: &[f64]) -> Result<Self, ModelError> {
        let point = self.point.at(coordinates);
        let whitened = Self::whitened(problem, &point, Arc::clone(&self.signals));
        Self::through(problem, point, whitened)
    }

    /// Evaluates a point whose whitening the records have passed. Errors: no finite prediction errors there.
    pub fn through(problem: &Problem, point: Point, signals: Arc<Whitened>) -> Result<Self, ModelError> {
        let regressors = problem.regressors(&point.a(), &signals);
        let projection = Projection::new(problem, &regressors)?;
        let memory = Memory { damping: FIRST_DAMPING, secant: Secant::new(point.len()) };
        Ok(Self {
            point,
            signals,
            regressors,
            projection,
            gradient: f64::NAN,
            iterations: 0,
            ending: Ending::IterationLimit,
            memory,
        })
    }

    /// The same model seen through another whitening or in other data: iterations go on; the secant
    /// estimate goes on in proportion to the costs.
    pub fn carried(problem: &Problem, point: Point, from: &Self) -> Result<Self, ModelError> {
        let next = Self::new(problem, point)?;
        let memory = if next.point.len() == from.point.len() {
            let Memory { damping, mut secant } = from.memory.clone();
            secant.rescale(next.projection.cost / from.projection.cost);
            Memory { damping, secant }
        } else {
            next.memory
        };
        Ok(Self { iterations: from.iterations, memory, ..next })
    }

    /// Prediction errors.
    pub fn residual(&self) -> Vec<f64> {
        residual(&self.regressors.slices(), &self.projection.theta)
    }

    /// Kaufman's Jacobian in coordinates, projected, and the residual.
    pub fn sensitivities(&self, problem: &Problem) -> Result<Sensitivities, ModelError> {
        let e = self.residual();
        let mut jacobian = self.jacobian(problem, &e);
        to_coordinates(&mut jacobian, &self.point);
        self.projection.sensitivities(problem, &self.regressors, &e, jacobian)
    }

    /// Derivatives of the residual to the coefficients of poles and, where free, predictor.
    pub fn coefficient_jacobian(&self, problem: &Problem) -> Columns {
        self.jacobian(problem, &self.residual())
    }

    fn jacobian(&self, problem: &Problem, e: &[f64]) -> Columns {
        coefficient_jacobian(problem, &self.point, &self.regressors, &self.projection.theta, e)
    }
}
