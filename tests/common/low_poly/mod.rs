//! Low-poly props as people model them: 100 to 2,000 triangles with hard edges, holes, rings and
//! cards, in several parts. Each is a few lines that place forms, and the same on every run.

mod forms;
mod furniture;
mod machines;
mod outdoors;
pub(crate) mod prop;
mod solid;
mod structures;

use super::build::Build;
use super::output::Output;
use prop::Prop;

/// A prop by name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model {
    pub(crate) name: &'static str,
    /// Whether every edge has an even number of triangles once equal positions are one.
    pub(crate) closed: bool,
    make: fn() -> Prop,
}

impl Model {
    /// As a document.
    pub(crate) fn build(&self) -> Build {
        (self.make)().build()
    }
}

const fn closed(name: &'static str, make: fn() -> Prop) -> Model {
    Model { name, closed: true, make }
}

const fn open(name: &'static str, make: fn() -> Prop) -> Model {
    Model { name, closed: false, make }
}

/// All of them.
pub(crate) const MODELS: [Model; 30] = [
    open("ball_on_floor", outdoors::ball_on_floor),
    closed("table_and_chairs", furniture::table_and_chairs),
    closed("traffic_light", outdoors::traffic_light),
    closed("street_lamp", outdoors::street_lamp),
    closed("radio_mast", structures::radio_mast),
    open("house", structures::house),
    closed("speaker", machines::speaker),
    closed("tugboat", machines::tugboat),
    closed("chain", machines::chain),
    closed("railing", structures::railing),
    closed("picket_fence", structures::picket_fence),
    closed("grate", structures::grate),
    open("foliage", outdoors::foliage),
    open("tree", outdoors::tree),
    closed("stairs", structures::stairs),
    closed("barrel", furniture::barrel),
    closed("bookshelf", furniture::bookshelf),
    closed("gear", machines::gear),
    closed("bicycle_wheel", machines::bicycle_wheel),
    closed("wire_cube", structures::wire_cube),
    closed("signpost", outdoors::signpost),
    closed("mushrooms", outdoors::mushrooms),
    closed("car", machines::car),
    closed("doubled_sheet", outdoors::doubled_sheet),
    closed("ladder", structures::ladder),
    closed("crate_stack", furniture::crate_stack),
    closed("cup", furniture::cup),
    open("picture_frame", furniture::picture_frame),
    closed("spoon", furniture::spoon),
    closed("castle_tower", structures::castle_tower),
];

/// How far the surface may be off at either end of an axis, over the diagonal: what is thinner has no
/// extent to lose across.
const DEVIATION: f32 = 0.025;

/// How much of a source's extent a level keeps: the least, over the axes, of its box's side over the
/// source's, beyond what both ends may be off.
pub(crate) fn extent_kept(source: &Output, level: &Output) -> f32 {
    let sides = |output: &Output| {
        let [low, high] = output.scene_box();
        high - low
    };
    let (whole, kept) = (sides(source), sides(level));
    let slack = 2.0 * DEVIATION * whole.length();
    let kept = |axis: usize| ((kept[axis] + slack) / whole[axis]).min(1.0);
    (0..3).filter(|&axis| whole[axis] > slack).map(kept).fold(1.0, f32::min)
}
