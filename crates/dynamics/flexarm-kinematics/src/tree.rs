//! Trees of the recursions: one model, or one with an inertia per lane.

use std::sync::Arc;

use flexarm_spatial::{Real, SpatialInertia};

use crate::model::Model;

/// Tree with inertias in the scalar type of a recursion: a [`Model`], or one with an inertia per
/// lane ([`LaneTree`]).
pub trait Tree<T: Real> {
    /// Bodies and joints, identical in all lanes.
    fn model(&self) -> &Model;

    /// Inertia of a body about Bo, B axes.
    fn inertia(&self, body: usize) -> SpatialInertia<T>;
}

impl Tree<f64> for Model {
    #[inline(always)]
    fn model(&self) -> &Model {
        self
    }

    #[inline(always)]
    fn inertia(&self, body: usize) -> SpatialInertia {
        self.bodies[body].inertia
    }
}

/// Tree with separate inertias for each lane.
#[derive(Clone, Debug)]
pub struct LaneTree<T: Real> {
    pub(crate) model: Arc<Model>,
    inertia: Vec<SpatialInertia<T>>,
}

impl<T: Real> LaneTree<T> {
    /// Builds the tree from one model per lane; `None` if the models differ in more than their
    /// inertias, if their number is not the number of lanes, or if they have closed loops.
    pub fn new(models: &[Arc<Model>]) -> Option<Self> {
        let first = models.first().filter(|_| models.len() == T::LANES)?;
        // Loops are closed by an iteration whose length depends on the configuration.
        if !first.loops.is_empty() {
            return None;
        }
        if !models.iter().all(|model| Arc::ptr_eq(model, first) || model.is_same_tree(first)) {
            return None;
        }
        let inertia = |body: usize| {
            let mut all = SpatialInertia::<T>::lift(&first.bodies[body].inertia);
            for (lane, model) in models.iter().enumerate() {
                let own = &model.bodies[body].inertia;
                all.mass.set_lane(lane, own.mass);
                for (to, from) in all.first_moment.iter_mut().zip(&own.first_moment) {
                    to.set_lane(lane, *from);
                }
                for (to, from) in all.rotational.iter_mut().zip(&own.rotational) {
                    to.set_lane(lane, *from);
                }
            }
            all
        };
        Some(Self { model: first.clone(), inertia: (0..first.bodies.len()).map(inertia).collect() })
    }

    /// Model of the first lane.
    pub fn model(&self) -> &Model {
        &self.model
    }
}

impl<T: Real> Tree<T> for LaneTree<T> {
    #[inline(always)]
    fn model(&self) -> &Model {
        &self.model
    }

    #[inline(always)]
    fn inertia(&self, body: usize) -> SpatialInertia<T> {
        self.inertia[body]
    }
}
