//! What the user asks of single parts of an asset, as lists over the points of its meshes.

use glam::DMat4;
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;
use seamwise_attr::{Mesh, Options, PointId};

use crate::accessor::Elements;
use crate::asset::Asset;
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Part};
use crate::nodes::world_nodes;

/// What a descent is to keep to, beyond its targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    /// No collapse may have an error above this, in the units of the scene.
    pub max_error: Option<f64>,
    /// No triangle may turn by more than this in a collapse, in degrees above 0 and up to 90.
    pub max_turn: f64,
    /// Materials by name: the points of their triangles stay as they are, in descent and polish.
    pub lock_materials: Vec<String>,
    /// A vertex attribute of one component: points where it is above 0.5 stay as they are.
    pub lock_attribute: Option<String>,
}

/// What is asked of one mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshSteering {
    /// How much longer a length of the mesh gets in the scene, at most.
    stretch: f64,
    /// In the units of the mesh.
    max_error: Option<f64>,
    max_turn: f64,
    /// One per point, or empty.
    locked: Vec<bool>,
}

impl Default for Steering {
    fn default() -> Self {
        let max_turn = Options::default().max_turn;
        Self { max_error: None, max_turn, lock_materials: Vec::new(), lock_attribute: None }
    }
}

impl Steering {
    /// Checks that the figures make sense.
    ///
    /// # Errors
    /// [`Error::Options`] if one does not.
    pub fn check(&self) -> Result<()> {
        let refuse = |what: &str| Err(Error::Options { what: what.into() });
        if self.max_error.is_some_and(|error| error.is_nan() || error < 0.0) {
            return refuse("the error limit must be 0 or more");
        }
        if !(self.max_turn > 0.0 && self.max_turn <= 90.0) {
            return refuse("a turn must be above 0 and at most 90 degrees");
        }
        Ok(())
    }

    /// What is asked of each of the meshes.
    ///
    /// # Errors
    /// [`Error::Options`] if a material or an attribute is named that is not there, with those
    /// that are.
    pub(crate) fn resolve(
        &self,
        asset: &Asset,
        geometries: &[Geometry],
    ) -> Result<Vec<MeshSteering>> {
        let materials = self.lock_materials.iter().map(|name| material(asset, name));
        let materials = materials.collect::<Result<Vec<_>>>()?.concat();
        if let Some(name) = &self.lock_attribute {
            check_attribute(geometries, name)?;
        }
        let stretches = stretches(asset)?;
        let steer = |geometry: &Geometry| {
            let stretch = stretches.get(&geometry.mesh).copied().unwrap_or(1.0);
            Ok(MeshSteering {
                stretch,
                max_error: self.max_error.map(|error| error / stretch),
                max_turn: self.max_turn,
                locked: self.locks(geometry, &materials)?,
            })
        };
        geometries.iter().map(steer).collect()
    }

    /// One per point: whether it is locked. Empty if nothing is.
    fn locks(&self, geometry: &Geometry, materials: &[usize]) -> Result<Vec<bool>> {
        let mesh = &geometry.welded.mesh;
        let mut locked = Vec::new();
        for (group, part) in (0..).zip(&geometry.parts) {
            if part.primitive.material.is_some_and(|own| materials.contains(&own)) {
                locked.resize(mesh.positions.len(), false);
                for point in points_of(mesh, group) {
                    locked[point] = true;
                }
            }
        }
        if let Some(name) = &self.lock_attribute {
            for (point, value) in point_values(geometry, name)? {
                locked.resize(mesh.positions.len(), false);
                locked[point] |= value > 0.5;
            }
        }
        Ok(locked)
    }
}

impl MeshSteering {
    /// The options of its descent and polish.
    pub(crate) fn options(&self) -> Options<'_> {
        let Self { max_error, max_turn, ref locked, .. } = *self;
        Options { max_error, max_turn, locked, ..Options::default() }
    }

    /// How much longer a length of the mesh gets in the scene, at most.
    pub(crate) fn stretch(&self) -> f64 {
        self.stretch
    }
}

/// By mesh: the greatest factor that a node of the scene stretches its lengths by.
fn stretches(asset: &Asset) -> Result<FxHashMap<usize, f64>> {
    let mut stretches = FxHashMap::default();
    for (node, world) in world_nodes(asset)? {
        if let Some(mesh) = asset.reference(&format!("/nodes/{node}"), "mesh", "meshes")? {
            let stretch = stretches.entry(mesh).or_insert(0.0f64);
            *stretch = stretch.max(largest_stretch(&world));
        }
    }
    stretches.retain(|_, stretch| *stretch > 0.0 && stretch.is_finite());
    Ok(stretches)
}

/// The largest singular value of a transform's linear part.
fn largest_stretch(world: &DMat4) -> f64 {
    let columns = [world.x_axis, world.y_axis, world.z_axis];
    let linear = Matrix3::from_columns(&columns.map(|c| Vector3::new(c.x, c.y, c.z)));
    linear.singular_values().max()
}

/// The materials of a name.
fn material(asset: &Asset, name: &str) -> Result<Vec<usize>> {
    let names: Vec<Option<&str>> = (0..asset.count("materials"))
        .map(|index| asset.json["materials"][index]["name"].as_str())
        .collect();
    let found: Vec<usize> = (0..names.len()).filter(|&i| names[i] == Some(name)).collect();
    if found.is_empty() {
        let what = format!("no material is named {name}; {}", there_are(names.iter().flatten()));
        return Err(Error::Options { what });
    }
    Ok(found)
}

/// Makes sure that some vertices carry an attribute.
fn check_attribute(geometries: &[Geometry], name: &str) -> Result<()> {
    let parts = || geometries.iter().flat_map(|geometry| &geometry.parts);
    if parts().any(|part| part.carried.iter().any(|(own, _)| own == name)) {
        return Ok(());
    }
    let names = parts().flat_map(|part| &part.carried).map(|(name, _)| name);
    Err(Error::Options { what: format!("no vertex carries {name}; {}", there_are(names)) })
}

fn there_are(names: impl Iterator<Item = impl AsRef<str> + Ord>) -> String {
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    names.dedup();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        "there are none".into()
    } else {
        format!("there are {}", names.join(", "))
    }
}

/// The points of a group's triangles, some more than once.
fn points_of(mesh: &Mesh, group: u32) -> impl Iterator<Item = usize> + '_ {
    let triangles = (0..mesh.triangles.len()).filter(move |&t| mesh.groups[t] == group);
    triangles.flat_map(|t| mesh.triangle_points(t)).map(PointId::index)
}

/// What the vertices that carry `name` have there, with their points. A point has one for each of
/// its wedges.
fn point_values(geometry: &Geometry, name: &str) -> Result<Vec<(usize, f32)>> {
    let mut values = Vec::new();
    for part in &geometry.parts {
        let Some((_, elements)) = part.carried.iter().find(|(own, _)| own == name) else {
            continue;
        };
        let floats = scalars(part, name, elements)?;
        for (&vertex, point) in geometry.welded.wedge_vertices.iter().zip(wedge_points(geometry)) {
            let own = vertex.checked_sub(part.first).and_then(|own| floats.get(own as usize));
            values.extend(own.map(|&value| (point, value)));
        }
    }
    Ok(values)
}

fn wedge_points(geometry: &Geometry) -> impl Iterator<Item = usize> + '_ {
    geometry.welded.mesh.wedge_points.iter().map(|point| point.index())
}

/// The elements of an attribute that must have one component.
fn scalars(part: &Part, name: &str, elements: &Elements) -> Result<Vec<f32>> {
    if elements.components != 1 {
        let what = format!("{} components, not one", elements.components);
        return Err(Error::invalid(format!("{}/attributes/{name}", part.primitive.at), what));
    }
    Ok(elements.floats())
}
