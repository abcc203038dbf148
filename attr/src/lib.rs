//! Geometry of Seamwise: meshes with attributes in wedges, and their simplification. Knows no
//! files and no images.
//!
//! In one call: [`simplify`](fn@simplify) takes a program's own arrays, and [`Simplifier`] takes
//! settings, locks and importance with them. Step by step: [`weld`] turns a file's vertices into points and wedges; [`simplify_chain`] collapses
//! edges in the order of the generalized quadric's cost and emits a [`Level`] each time a target is
//! passed; [`polish_chain`] fits each level to the mesh it was made from.
//!
//! # The generalized quadric
//!
//! Over a triangle every attribute s_j is a linear function of position, g_jᵀp + d_j. The cost of
//! moving a vertex to (p, s) is its squared distance to the triangle's plane plus the squared
//! differences of its attributes to what the triangle has there (Garland & Heckbert 1998; Hoppe
//! 1999). Quadrics belong to wedges: merging two points adds the quadrics of those wedges that meet
//! in a collapsing triangle, and leaves the others alone. For a fixed position the best attributes
//! are in closed form, so each wedge reduces to a plain quadric in position; their sum is solved
//! once, and a seam moves as one.
//!
//! # Continuous levels
//!
//! [`record_chain`] gives with the levels the collapses between them, as a [`ProgressiveMesh`] that is as
//! fine as it is asked to be, up to the source to the bit.
//!
//! # Where a descent ends
//!
//! At its targets; where nothing legal is left ([`Stop::NoLegalCollapse`]); before a cost above
//! [`Settings::max_error`]; or, with [`Settings::max_deviation`], before the shape is ruined
//! ([`Stop::Deviation`]). Before that, obstacles are removed at their cost: loops of three edges
//! around handles, holes and necks become points, and small shells go.

mod buckets;
mod bvh;
mod cards;
mod chain;
mod collapse;
mod constraints;
mod decimate;
mod edges;
mod equal_volume;
mod error;
mod facing;
mod front;
mod id;
mod importance;
mod isosurface;
mod item;
mod layers;
mod marks;
mod mesh;
mod metric;
mod motion;
mod options;
mod origin;
mod plane_quadrics;
mod polish;
mod progressive;
mod quadric;
mod queue;
mod rank;
mod ray;
mod region_source;
mod regions;
mod sample;
mod sets;
mod settings;
mod shape;
mod sharing;
mod simplifier;
mod simplify;
mod solve;
mod space;
mod stitch;
mod surface;
mod tangent;
#[cfg(test)]
mod testing;
mod together;
mod topology;
mod triangle;
mod vertices;
mod vicinity;
mod weld;
mod working_mesh;

pub use cards::grow_cards;
pub use chain::{Level, polish_chain, simplify_chain};
pub use decimate::decimate_chain;
pub use edges::{Census, border_edges};
pub use error::{Error, Result};
pub use front::{Layered, keep_fronts};
pub use id::{CornerId, PointId, TriangleId, WedgeId};
pub use importance::{Eye, View, curvature_importance, view_importance};
pub use isosurface::{Ellipsoid, Isosurface, Ray};
pub use mesh::{Layout, Mesh};
pub use motion::{Motion, Pose};
pub use options::Options;
pub use origin::{Origin, find_origins};
pub use plane_quadrics::{PlaneQuadrics, sum_planes};
pub use polish::Polish;
pub use polish::influences::{Influences, fit_influences};
pub use progressive::mesh::{Change, Collapse, Extracted, Moved, ProgressiveMesh};
pub use progressive::morph::MorphEnd;
pub use progressive::order::ProgressiveScene;
pub use progressive::record::{Recorded, record_chain, record_together};
pub use progressive::selective::camera::Camera;
pub use progressive::selective::mesh::SelectiveMesh;
pub use progressive::selective::refine::{Goal, Refined, refine_together};
pub use progressive::settle::Unsettled;
pub use progressive::split::Split;
pub use quadric::{Gradient, PointQuadric};
pub use sample::{Sample, sample_surface};
pub use sets::DisjointSets;
pub use settings::{Cost, MAX_DEVIATION, Placement, Settings, Weights};
pub use simplifier::{Simplified, Simplifier, Target, simplify};
pub use simplify::Stop;
pub use stitch::{BorderEdge, OwnPosition, placed_borders, stitched_edges};
pub use surface::{Foot, Hit, Nearest, Surface};
pub use tangent::{TangentInput, compute_tangents};
pub use together::{Shared, simplify_together};
pub use triangle::{area_vector, closest_on_triangle};
pub use vertices::{Precision, Vertices};
pub use vicinity::Vicinity;
pub use weld::{Welded, weld};

pub use glam;
