//! Arguments of `seamwise bake` for the simplification.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;

use seamwise::bake::steering::{BorderLock, GrowCards, Importance, Order, Steering};
use seamwise::error::Result;
use seamwise_attr::{Eye, Placement, View};

use super::place::{numbers, parse_place};

/// Options of `seamwise bake` that steer the descent.
#[derive(Debug, Args)]
#[command(next_help_heading = "Steering the descent")]
pub(super) struct SteeringArgs {
    /// What a collapse costs.
    #[arg(long, value_enum, default_value_t = CostName::Quadric)]
    cost: CostName,
    /// Where a merged point goes.
    #[arg(long, value_enum, default_value_t = PlacementName::Best)]
    placement: PlacementName,
    /// Stop before an error above this, in the units of the scene.
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// Go on to the target even where that takes the surface farther than 2.5 % of the scene's diagonal
    /// from the source, or a tenth of its area: by default a level stops before, and says so.
    #[arg(long)]
    reach_target: bool,
    /// Rotate no triangle by more than this in any collapse.
    #[arg(long, alias = "max-turn", default_value_t = Steering::default().max_rotation, value_name = "DEGREES")]
    max_rotation: f64,
    /// Let points of two shells meet that are nearer than this, in the units of the scene: cracks
    /// close, and parts that touch are simplified as one.
    #[arg(long, value_name = "D")]
    join_distance: Option<f64>,
    /// Let points of one shell meet as well that are nearer than --join-distance without an edge between them: slits
    /// close, and thin walls become one.
    #[arg(long, requires = "join_distance")]
    join_own_shell: bool,
    /// Place merged points where the enclosed volume stays what it is.
    #[arg(long)]
    keep_volume: bool,
    /// Place points of open borders where the area that the surface covers stays what it is.
    #[arg(long)]
    keep_area: bool,
    /// Leave open borders as they are, so that tiles that are baked apart still meet: all of them, those on
    /// the sides of the box around the scene (sides), or on the sides of a box of your own, its least
    /// coordinates first.
    #[arg(long, value_name = "all|sides|X,Y,Z,X,Y,Z", num_args = 0..=1, require_equals = true, default_missing_value = "all", value_parser = parse_border_lock)]
    lock_border: Option<BorderLock>,
    /// Let small open parts, as the leaves of a tree, go whole and those that stay grow in their place, so that the
    /// area of each neighborhood stays: auto does so for materials that are cut out by alpha.
    #[arg(long, value_enum, default_value_t = GrowCardsName::Auto, value_name = "WHICH")]
    grow_cards: GrowCardsName,
    /// Leave all points of this material as they are; may be given more than once.
    #[arg(long, value_name = "NAME")]
    lock_material: Vec<String>,
    /// Leave all points as they are where this vertex attribute, of one component, is above 0.5.
    #[arg(long, value_name = "NAME")]
    lock_attribute: Option<String>,
    /// Multiply what it costs to change a vertex by this attribute of it, of one component, 0 or more.
    #[arg(long, value_name = "NAME")]
    importance_attribute: Option<String>,
    /// The same by a picture over the first UV set: white counts ten times as much as middle gray,
    /// black a tenth.
    #[arg(long, value_name = "FILE")]
    importance_map: Option<PathBuf>,
    /// Keep more of what a camera at this place of the scene sees from its front.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    view_from: Option<DVec3>,
    /// Keep more of what is seen from its front by who looks along this direction.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, conflicts_with = "view_from")]
    view_along: Option<DVec3>,
    /// How many times more it counts.
    #[arg(long, default_value_t = 10.0, value_name = "W")]
    view_weight: f64,
    /// The least cosine between a normal and the direction to the eye that counts as front.
    ///
    /// 1 faces the eye, 0 is seen edge-on, −1 faces away: 0 is all that can be seen from there, 0.5 only what is
    /// within 60° of facing it, −0.2 also a little of what lies beyond the outline, so that it stays round.
    #[arg(long, default_value_t = 0.0, value_name = "G", allow_negative_numbers = true)]
    view_cosine: f64,
    /// Keep more where the surface bends: (1 + curvature by the model's radius) to this power.
    #[arg(long, default_value_t = 0.0, value_name = "POWER")]
    curvature_weight: f64,
}

impl SteeringArgs {
    /// The options that these arguments give.
    pub(super) fn resolve(&self) -> Result<Steering> {
        let steering = Steering {
            order: match self.cost {
                CostName::Quadric => Order::Quadric,
                CostName::Geometry => Order::Geometry,
                CostName::EdgeLength => Order::EdgeLength,
                CostName::Classic => Order::Classic,
                CostName::Midpoint => Order::Midpoint,
                CostName::Decimation => Order::Decimation,
            },
            placement: match self.placement {
                PlacementName::Best => Placement::Best,
                PlacementName::Ends => Placement::Ends,
                PlacementName::Middle => Placement::Middle,
            },
            max_error: self.max_error,
            max_deviation: Steering::default().max_deviation.filter(|_| !self.reach_target),
            max_rotation: self.max_rotation,
            join_distance: self.join_distance,
            join_own_shell: self.join_own_shell,
            keep_volume: self.keep_volume,
            keep_area: self.keep_area,
            lock_border: self.lock_border,
            grow_cards: match self.grow_cards {
                GrowCardsName::Auto => GrowCards::Masked,
                GrowCardsName::On => GrowCards::All,
                GrowCardsName::Off => GrowCards::None,
            },
            lock_materials: self.lock_material.clone(),
            lock_attribute: self.lock_attribute.clone(),
            importance: Importance {
                attribute: self.importance_attribute.clone(),
                map: self.importance_map.clone(),
                view: self.view(),
                curvature: self.curvature_weight,
            },
        };
        steering.check()?;
        Ok(steering)
    }

    fn view(&self) -> Option<View> {
        let eye = self.view_from.map(Eye::At).or(self.view_along.map(Eye::Along))?;
        Some(View { eye, cosine: self.view_cosine, weight: self.view_weight })
    }
}

/// `--cost`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum CostName {
    /// Shape, texture, shading and vertex color, weighed together.
    Quadric,
    /// Shape alone, as a baseline.
    Geometry,
    /// The length of the edge, as a baseline.
    EdgeLength,
    /// The plain sum of squared distances to planes, as in the paper of 1997: summed once, at its minimum, an end
    /// or the middle, no borders held, and no polish.
    Classic,
    /// The length of the edge, to its middle, and no polish: the least that one can do.
    Midpoint,
    /// The distance of a vertex to the plane around it: vertices are removed and each hole is triangulated anew, as in
    /// the paper of 1992, each mesh by itself, and no polish.
    Decimation,
}

/// `--placement`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum PlacementName {
    /// Where it costs least.
    Best,
    /// At the cheaper end of the edge: vertices are the source's, and a polish leaves them alone.
    Ends,
    /// In the middle of the edge, as a baseline.
    Middle,
}

/// Reads `all`, `sides` or six coordinates.
fn parse_border_lock(text: &str) -> std::result::Result<BorderLock, String> {
    let wrong = || format!("{text} is not all, sides or a box like -1,0,-1,1,2,1");
    match text {
        "all" => Ok(BorderLock::All),
        "sides" => Ok(BorderLock::Sides),
        _ => {
            let parts = numbers(text).filter(|own| own.len() == 6).ok_or_else(wrong)?;
            let (low, high) = (DVec3::from_slice(&parts), DVec3::from_slice(&parts[3..]));
            Ok(BorderLock::Box { low, high })
        }
    }
}

/// `--grow-cards`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum GrowCardsName {
    /// Those of materials that are cut out by alpha.
    Auto,
    /// All.
    On,
    /// None.
    Off,
}
