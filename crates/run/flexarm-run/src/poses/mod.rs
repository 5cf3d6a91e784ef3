//! An arm held at a pose: statics, modes, frequency response.

pub mod inspect;
pub(crate) mod mode_recording;
pub(crate) mod modes;
pub mod posed;
pub mod response;
pub(crate) mod statics;
pub(crate) mod statics_picture;
