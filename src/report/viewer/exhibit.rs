//! A model that a view shows.

use serde_json::{Value, json};

use crate::document::asset::Asset;
use crate::export::progressive::timeline::Timeline;

/// A model to be shown.
#[derive(Clone, Copy, Debug)]
pub struct Exhibit<'a> {
    /// Its file.
    pub file: &'a str,
    /// The model.
    pub asset: &'a Asset,
    /// The largest size at which it may be shown, in pixels that the diagonal of the source's bounding
    /// box spans, if that was measured; where it is not given, what the file itself says counts.
    pub largest_size: Option<f64>,
    /// All of its levels, if it is a progressive file: the model is the coarsest of them then.
    pub timeline: Option<&'a Timeline>,
}

impl<'a> Exhibit<'a> {
    /// A model of which nothing else is known.
    pub fn new(file: &'a str, asset: &'a Asset) -> Self {
        Self { file, asset, largest_size: None, timeline: None }
    }

    /// What is known of the size it may be shown at, as the certificate in a file says it.
    pub(super) fn certificate(&self) -> Option<Value> {
        let size = self.largest_size?;
        Some(json!({"largest_size_pixels": size.is_finite().then_some(size)}))
    }
}
