//! How far a candidate is from its reference.

pub mod scene;
