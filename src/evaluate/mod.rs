//! How far a candidate is from its reference.

pub mod appearance;
pub mod distance;
pub mod sample;
pub mod scene;
pub mod volume;
