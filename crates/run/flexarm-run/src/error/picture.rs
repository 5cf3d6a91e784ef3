//! Reasons why there is no picture of an arm.

/// Reason why there is no picture of an arm.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum NoPicture {
    #[cfg(feature = "png")]
    #[error(transparent)]
    Arm(#[from] flexarm_draw::ArmPictureError),
    #[cfg(not(feature = "png"))]
    #[error("this build has no pictures: it was made without the feature png")]
    NotBuilt,
}
