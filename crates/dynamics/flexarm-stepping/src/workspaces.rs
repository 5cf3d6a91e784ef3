//! Workspaces of the recursions over one tree, handed from run to run.
//!
//! An arm shares them with all its copies: what a run gives back, the next one takes. New or used,
//! the bits are the same, for a recursion writes everything that it reads. Trees whose workspaces
//! begin where they were last (closed loops), or that are rarely run often (modal bodies,
//! balancers), get new ones each time, and so does an arm whose masses have changed since it was
//! made.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_kinematics::{Data, FreeForces, Model, Observer, Roles};

use crate::arm::FlexibleArm;

/// Where workspaces wait for the next run.
type Shelf<T> = Arc<Mutex<Vec<T>>>;

/// The workspaces that nobody uses just now.
#[derive(Clone)]
pub struct Workspaces {
    /// The tree that they are for.
    model: Arc<Model>,
    data: Shelf<Data>,
    points: Shelf<FreeForces>,
    observers: Shelf<Observer>,
}

impl Workspaces {
    /// None yet.
    pub(crate) fn of(model: &Arc<Model>) -> Self {
        Self { model: model.clone(), data: Shelf::default(), points: Shelf::default(), observers: Shelf::default() }
    }

    /// Whether they are for this very model, and none of them remembers anything.
    fn are_for(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(&self.model, model)
            && model.loops().is_empty()
            && model.balancers().is_empty()
            && !model.has_modal()
    }
}

impl FlexibleArm {
    /// A workspace for recursions over the tree, without external wrenches: one that a run before
    /// gave back, or a new one.
    pub fn lend_data(&self) -> Lent<Data> {
        let shelf = self.workspaces.are_for(&self.model).then_some(&self.workspaces.data);
        let mut lent = Lent::from(shelf, || Some(Data::new(&self.model))).expect("there are always new ones");
        lent.clear_external_wrenches();
        lent
    }

    /// The same of [`Observer::new`]: `None` where there is none for the tree.
    pub fn lend_observer(&self) -> Option<Lent<Observer>> {
        let shelf = self.workspaces.are_for(&self.model).then_some(&self.workspaces.observers);
        Lent::from(shelf, || Observer::new(&self.model))
    }

    /// The same of [`FreeForces::new`].
    pub(crate) fn lend_points(&self, roles: &Roles) -> Option<Lent<FreeForces>> {
        // Of the springs alone: which joints are driven by torque may change from arm to arm.
        let held = roles.free_coordinates().first().is_none_or(|first| *first >= self.model.n_actuated());
        let shelf = (held && self.workspaces.are_for(&self.model)).then_some(&self.workspaces.points);
        Lent::from(shelf, || FreeForces::new(&*self.model, roles))
    }
}

/// A workspace on loan; dropping it gives it back.
pub struct Lent<T> {
    /// There until it is given back.
    it: Option<T>,
    shelf: Option<Shelf<T>>,
}

impl<T> Lent<T> {
    fn from(shelf: Option<&Shelf<T>>, make: impl FnOnce() -> Option<T>) -> Option<Self> {
        let used = shelf.and_then(|shelf| shelf.lock().unwrap_or_else(PoisonError::into_inner).pop());
        let it = used.or_else(make)?;
        Some(Self { it: Some(it), shelf: shelf.cloned() })
    }

    /// It will not be given back: what stands in it is no longer that of the arm.
    pub fn keep(&mut self) {
        self.shelf = None;
    }
}

impl<T> Deref for Lent<T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        self.it.as_ref().expect("it is given back at the end alone")
    }
}

impl<T> DerefMut for Lent<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut T {
        self.it.as_mut().expect("it is given back at the end alone")
    }
}

impl<T> Drop for Lent<T> {
    fn drop(&mut self) {
        // After a panic nobody knows what stands in it.
        if let (Some(it), Some(shelf), false) = (self.it.take(), &self.shelf, std::thread::panicking()) {
            shelf.lock().unwrap_or_else(PoisonError::into_inner).push(it);
        }
    }
}
