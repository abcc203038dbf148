//! Options of the simplification as the user gives them, resolved to options and lists over the
//! points of each mesh.

mod borders;
mod cards;
mod colors;
mod frame;
mod importance;
mod motion;
mod scene_box;
mod values;

use glam::DMat4;
use seamwise_attr::{Cost, MAX_DEVIATION, Motion, Options, Placement, Settings, Weights};

use crate::document::asset::Asset;
use crate::document::nodes::{largest_stretch, mesh_worlds, stretches};
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;
use crate::surface::geometry::Geometry;
pub use borders::BorderLock;
use borders::lock_borders;
pub use cards::GrowCards;
use colors::Colors;
use frame::ShownFrame;
pub use importance::Importance;
use importance::Map;
use motion::motion;
use scene_box::SceneBox;
use values::{check_attribute, material, point_values, points_of};

/// The order of collapses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// By their cost in shape, texture, shading and vertex color.
    #[default]
    Quadric,
    /// By their cost in shape alone.
    Geometry,
    /// By the length of their edges.
    EdgeLength,
    /// By the plain sum of squared distances to planes, summed once, and nothing else: see
    /// [`Cost::Classic`]. Levels are not polished, and go on to their targets.
    Classic,
    /// By the length of their edges, to the middle of each. Levels are not polished, and go on to their
    /// targets.
    Midpoint,
    /// Points one by one, the nearest to the plane around each first, with the hole of each triangulated anew: see
    /// [`decimate_chain`](seamwise_attr::decimate_chain). Vertices are the source's; levels are not polished, and
    /// each mesh goes on to its share.
    Decimation,
}

impl Order {
    /// Whether levels are as the descent leaves them, whatever it costs: a baseline to compare with.
    pub(crate) fn is_bare(self) -> bool {
        matches!(self, Self::Classic | Self::Midpoint | Self::Decimation)
    }

    /// Whether points are removed, not merged.
    pub(crate) fn removes_points(self) -> bool {
        self == Self::Decimation
    }
}

/// Options of a simplification beyond its targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    /// The order of collapses.
    pub order: Order,
    /// The placement of merged points.
    pub placement: Placement,
    /// No collapse may have an error above this, in the units of the scene.
    pub max_error: Option<f64>,
    /// The largest distance of the surface to the source, as a share of the diagonal of the scene's
    /// bounding box, if there is a limit: see [`MAX_DEVIATION`].
    pub max_deviation: Option<f64>,
    /// No triangle may rotate by more than this in a collapse, in degrees above 0 and up to 90.
    pub max_rotation: f64,
    /// Points of two shells nearer than this, in the units of the scene, may merge.
    pub join_distance: Option<f64>,
    /// Whether points of one shell may merge so as well.
    pub join_own_shell: bool,
    /// Whether the enclosed volume stays what it is.
    pub keep_volume: bool,
    /// Whether the area within open borders stays what it is.
    pub keep_area: bool,
    /// The open borders that stay as they are, if any: neighbors that are baked apart meet there.
    pub lock_border: Option<BorderLock>,
    /// The surfaces whose small open shells, leaves say, grow as others go.
    pub grow_cards: GrowCards,
    /// Materials by name: the points of their triangles stay as they are, in descent and polish.
    pub lock_materials: Vec<String>,
    /// A vertex attribute of one component: points where it is above 0.5 stay as they are.
    pub lock_attribute: Option<String>,
    /// The importance of points.
    pub importance: Importance,
}

/// Options of the simplification of one mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshSteering {
    /// The frame that the mesh is simplified in, if that is not its own.
    frame: Option<ShownFrame>,
    /// One per instance in the scene: the largest factor on lengths in that frame.
    stretches: Vec<f64>,
    /// Lengths are in the units of that frame.
    settings: Settings,
    /// One per point, or empty.
    locked: Vec<bool>,
    importance: Vec<f32>,
    colors: Vec<[f32; 3]>,
    cards: Vec<bool>,
    motion: Option<Motion>,
}

impl Default for Steering {
    fn default() -> Self {
        Self {
            order: Order::default(),
            placement: Placement::default(),
            max_error: None,
            max_deviation: Some(MAX_DEVIATION),
            max_rotation: Settings::default().max_rotation,
            join_distance: None,
            join_own_shell: false,
            keep_volume: false,
            keep_area: false,
            lock_border: None,
            grow_cards: GrowCards::default(),
            lock_materials: Vec::new(),
            lock_attribute: None,
            importance: Importance::default(),
        }
    }
}

impl Steering {
    /// Checks that the figures make sense.
    ///
    /// # Errors
    /// [`Error::Options`] if one does not.
    pub fn check(&self) -> Result<()> {
        self.settings(1.0, 1.0)
            .check()
            .map_err(|error| Error::Options { what: error.to_string() })?;
        self.lock_border.as_ref().map_or(Ok(()), BorderLock::check)?;
        self.importance.check()
    }

    /// The options of each mesh. Decoding a map may take as much memory as `limit`.
    ///
    /// # Errors
    /// [`Error::Options`] if a material or an attribute is named that is not there, with those
    /// that are; [`Error::Io`] or [`Error::Invalid`] if a map can't be read.
    pub(crate) fn resolve(
        &self,
        asset: &Asset,
        geometries: &[Geometry],
        limit: MemoryLimit,
    ) -> Result<Vec<MeshSteering>> {
        let materials = self.lock_materials.iter().map(|name| material(asset, name));
        let materials = materials.collect::<Result<Vec<_>>>()?.concat();
        for name in self.lock_attribute.iter().chain(&self.importance.attribute) {
            check_attribute(geometries, name)?;
        }
        let read = |path| Map::read(path, limit);
        let map = self.importance.map.as_deref().map(read).transpose()?;
        let worlds = mesh_worlds(asset)?;
        let scene = SceneBox::around(geometries, &worlds);
        let mut colors = Colors::new(asset, limit);
        let steer = |geometry: &Geometry| {
            let worlds = worlds.get(&geometry.meshes[0]).map_or(&[][..], Vec::as_slice);
            let frame = ShownFrame::of(worlds);
            let in_frame = frame.map_or_else(|| worlds.to_vec(), |frame| frame.worlds(worlds));
            let (stretch, stretches) = (largest_stretch(&in_frame), stretches(&in_frame));
            let locked = self.locks(geometry, &materials, worlds, &scene)?;
            Ok(MeshSteering {
                frame,
                stretches,
                settings: self.settings(stretch, scene.diagonal()),
                importance: self.importance.of_points(geometry, map.as_ref(), worlds)?,
                colors: match self.max_deviation {
                    Some(_) => colors.of_points(geometry)?,
                    None => Vec::new(),
                },
                cards: match self.placement_of_points() {
                    // Vertices that are the source's can't grow.
                    Placement::Ends => Vec::new(),
                    _ => self.grow_cards.of_points(asset, geometry, &locked),
                },
                motion: match self.order {
                    Order::Quadric => motion(asset, geometry, frame.as_ref())?,
                    _ => None,
                },
                locked,
            })
        };
        geometries.iter().map(steer).collect()
    }

    /// The placement of points that the order leaves.
    fn placement_of_points(&self) -> Placement {
        match self.order {
            Order::Midpoint => Placement::Middle,
            Order::Classic => Placement::Best,
            Order::Decimation => Placement::Ends,
            Order::Quadric | Order::Geometry | Order::EdgeLength => self.placement,
        }
    }

    /// The settings of a mesh that a scene of this diagonal shows `stretch` times as long, at most.
    fn settings(&self, stretch: f64, diagonal: f64) -> Settings {
        let weights = match self.order {
            Order::Geometry => Weights { uv: 0.0, normal: 0.0, color: 0.0, ..Weights::default() },
            _ => Weights::default(),
        };
        let cost = match self.order {
            Order::Quadric | Order::Geometry | Order::Decimation => Cost::Quadric,
            Order::EdgeLength | Order::Midpoint => Cost::EdgeLength,
            Order::Classic => Cost::Classic,
        };
        let max_deviation = self.max_deviation.filter(|_| !self.order.is_bare());
        Settings {
            weights,
            cost,
            placement: self.placement_of_points(),
            max_error: self.max_error.map(|error| error / stretch),
            max_deviation: max_deviation.map(|share| share * diagonal / stretch),
            max_rotation: self.max_rotation,
            join_distance: self.join_distance.map(|distance| distance / stretch),
            join_own_shell: self.join_own_shell,
            keep_volume: self.keep_volume,
            keep_area: self.keep_area,
            ..Settings::for_diagonal(diagonal)
        }
    }

    /// One per point: whether it is locked. Empty if nothing is.
    fn locks(
        &self,
        geometry: &Geometry,
        materials: &[usize],
        worlds: &[DMat4],
        scene: &SceneBox,
    ) -> Result<Vec<bool>> {
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
        if let Some(lock) = &self.lock_border {
            lock_borders(lock, &mut locked, &geometry.welded.mesh, worlds, scene);
        }
        Ok(locked)
    }
}

impl MeshSteering {
    /// The options of its descent and polish.
    pub(crate) fn options(&self) -> Options<'_> {
        Options {
            settings: self.settings,
            importance: &self.importance,
            colors: &self.colors,
            locked: &self.locked,
            cards: &self.cards,
            motion: self.motion.as_ref(),
        }
    }

    /// The frame that the mesh is simplified in, if that is not its own.
    pub(crate) fn frame(&self) -> Option<&ShownFrame> {
        self.frame.as_ref()
    }

    /// The largest factor on lengths of the mesh, in its frame, in the scene.
    pub(crate) fn stretch(&self) -> f64 {
        self.stretches.iter().copied().fold(0.0, f64::max)
    }

    /// The largest factor for each instance in the scene; never empty.
    pub(crate) fn stretches(&self) -> &[f64] {
        &self.stretches
    }
}
