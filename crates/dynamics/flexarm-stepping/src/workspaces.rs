//! Pool of workspaces for recursions over one tree, reused from run to run.
//!
//! An arm shares the pool with all its copies: workspaces returned by one run are reused by the
//! next. Results are bitwise the same with new and reused workspaces, because a recursion writes
//! everything it reads. Fresh workspaces are allocated each time for trees whose recursions start
//! from the previous solution (closed loops), for trees that are rarely run in large numbers (modal
//! bodies, balancers), and for an arm whose masses have changed since it was created.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_kinematics::{Data, Model};

use crate::arm::FlexibleArm;

/// Pool of unused workspaces.
type Pool<T> = Arc<Mutex<Vec<T>>>;

/// Workspaces that are currently unused.
#[derive(Clone)]
pub struct Workspaces {
    /// Model for which they were made.
    model: Arc<Model>,
    data: Pool<Data>,
}

impl Workspaces {
    /// Creates an empty pool.
    pub(crate) fn of(model: &Arc<Model>) -> Self {
        Self { model: model.clone(), data: Pool::default() }
    }

    /// Returns whether they belong to this same model and carry no state between uses.
    fn are_for(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(&self.model, model)
            && model.loops().is_empty()
            && model.balancers().is_empty()
            && !model.has_modal()
    }
}

impl FlexibleArm {
    /// Returns a workspace for recursions over the tree, without external wrenches: a returned one
    /// or a new one.
    pub fn lend_data(&self) -> PooledWorkspace<Data> {
        let pool = self.workspaces.are_for(&self.model).then_some(&self.workspaces.data);
        let mut lent = PooledWorkspace::from(pool, || Some(Data::new(&self.model))).expect("there are always new ones");
        lent.clear_external_wrenches();
        lent
    }
}

/// A borrowed workspace; dropping it returns it to the pool.
pub struct PooledWorkspace<T> {
    /// `Some` until it is returned.
    it: Option<T>,
    pool: Option<Pool<T>>,
}

impl<T> PooledWorkspace<T> {
    fn from(pool: Option<&Pool<T>>, make: impl FnOnce() -> Option<T>) -> Option<Self> {
        let used = pool.and_then(|pool| pool.lock().unwrap_or_else(PoisonError::into_inner).pop());
        let it = used.or_else(make)?;
        Some(Self { it: Some(it), pool: pool.cloned() })
    }
}

impl<T: Clone> Clone for PooledWorkspace<T> {
    fn clone(&self) -> Self {
        Self { it: self.it.clone(), pool: self.pool.clone() }
    }
}

impl<T> Deref for PooledWorkspace<T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        self.it.as_ref().expect("it is given back at the end alone")
    }
}

impl<T> DerefMut for PooledWorkspace<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut T {
        self.it.as_mut().expect("it is given back at the end alone")
    }
}

impl<T> Drop for PooledWorkspace<T> {
    fn drop(&mut self) {
        // After a panic the contents are undefined: drop the workspace.
        if let (Some(it), Some(pool), false) = (self.it.take(), &self.pool, std::thread::panicking()) {
            pool.lock().unwrap_or_else(PoisonError::into_inner).push(it);
        }
    }
}
