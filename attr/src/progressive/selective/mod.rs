//! Refinement by what is seen (Hoppe, "View-dependent refinement of progressive meshes", SIGGRAPH 1997): fine
//! where an eye looks closely, coarse elsewhere.
//!
//! Collapses need not be undone in their order. One may be done once all that came before it at its triangles
//! are done, and undone once all that came after it there are undone. So each triangle is, with all its corners,
//! one that the simplification had: what did not flip or tear there does not here, and what was measured of it
//! holds. That is stricter than Hoppe's law, which asks for four neighbors alone and has to look for flips.

pub(crate) mod bounds;
pub(crate) mod camera;
pub(crate) mod forest;
pub(crate) mod front;
pub(crate) mod mesh;
pub(crate) mod refine;
pub(crate) mod shading;
