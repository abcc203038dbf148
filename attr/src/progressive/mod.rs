//! Continuous levels: the collapses of a descent on record, to be undone as vertex splits (Hoppe,
//! "Progressive meshes", SIGGRAPH 1996).

pub(crate) mod log;
pub(crate) mod mesh;
pub(crate) mod morph;
pub(crate) mod order;
pub(crate) mod record;
mod replay;
pub(crate) mod selective;
pub(crate) mod settle;
pub(crate) mod split;
mod validate;
