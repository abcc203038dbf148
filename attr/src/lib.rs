//! Geometry of Seamwise: meshes with attributes in wedges, and their simplification. Knows no
//! files and no images.

mod bvh;
mod error;
mod id;
mod mesh;
mod ray;
mod surface;
mod triangle;

pub use error::{Error, Result};
pub use id::{CornerId, PointId, TriangleId, WedgeId};
pub use mesh::{Layout, Mesh};
pub use surface::{Foot, Hit, Nearest, Surface};
