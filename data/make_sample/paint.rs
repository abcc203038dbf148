//! From inks to light: what glaze, clay and gilding look like at a point, and how its fine relief
//! stands. Colors are linear Rec. 709.

use glam::DVec3;

use crate::decor::{Decor, Spot};
use crate::noise::{cracks, fractal, mix, spots, step, value};
use crate::profile::Part;

/// What a material map stores at a point.
pub(crate) struct Finish {
    /// Linear light.
    pub(crate) color: DVec3,
    pub(crate) occlusion: f64,
    pub(crate) roughness: f64,
    pub(crate) metallic: f64,
}

/// Absorption of the pigments at full strength, as exponents (Beer–Lambert); red is opaque.
const COBALT_ABSORBS: DVec3 = DVec3::new(4.3, 2.75, 0.75);
const TURQUOISE_ABSORBS: DVec3 = DVec3::new(2.7, 0.42, 0.52);
const RED_SLIP: DVec3 = DVec3::new(0.47, 0.045, 0.018);
const GLAZE: DVec3 = DVec3::new(0.83, 0.84, 0.80);
const CLAY: DVec3 = DVec3::new(0.50, 0.33, 0.19);
const DIRT: DVec3 = DVec3::new(0.30, 0.22, 0.14);
const GOLD: DVec3 = DVec3::new(0.98, 0.70, 0.29);

/// How much of the crackle's line is at a point.
fn crackle(spot: &Spot) -> f64 {
    let warp = |seed| 0.25 * value(spot.position / 6.0, seed);
    let at = spot.position / 10.0 + DVec3::new(warp(31), warp(32), warp(33));
    1.0 - step(0.012, 0.05, cracks(at, 34))
}

/// Dirt that settled in hollows, 0…1.
fn dirt(spot: &Spot) -> f64 {
    let patch = 0.65 + 0.6 * fractal(spot.position / 9.0, 3, 41);
    step(0.03, 0.30, spot.hollow) * patch.clamp(0.0, 1.0)
}

/// Wear on ridges, 0…1.
fn wear(spot: &Spot) -> f64 {
    let patch = fractal(spot.position / 4.0, 3, 42) + 0.25 * fractal(spot.position / 25.0, 2, 43);
    step(0.11, 0.25, -spot.hollow + 0.16 * patch)
}

/// The finish of a point.
pub(crate) fn finish(decor: &Decor, spot: &Spot) -> Finish {
    let mut finish = match spot.part {
        Part::Bore => bore(spot),
        part if part.is_metal() => gilding(spot),
        _ => glaze(decor, spot),
    };
    finish.occlusion = 1.0 - 0.75 * step(0.0, 0.45, spot.hollow);
    finish
}

fn glaze(decor: &Decor, spot: &Spot) -> Finish {
    let at = spot.position;
    let ink = decor.ink(spot);
    let streak = fractal(DVec3::new(at.x, at.y * 0.5, at.z) / 5.0, 3, 51);
    let density = 1.0 + 0.38 * streak + 0.12 * fractal(at / 2.2, 1, 52);
    let tone = 1.0 + 0.07 * fractal(at / 38.0, 4, 53) + 0.02 * value(at / 2.4, 54);
    let warm = 0.035 * fractal(at / 55.0, 2, 55);
    let absorbed = COBALT_ABSORBS * (ink.x * density) + TURQUOISE_ABSORBS * (ink.y * density);
    let mut color = GLAZE * DVec3::new(tone + warm, tone, tone - 1.6 * warm) * (-absorbed).exp();
    color = color.lerp(RED_SLIP * (1.0 + 0.35 * streak), ink.z.clamp(0.0, 1.0));
    let mut roughness = 0.16 + 0.05 * fractal(at / 12.0, 3, 56) + 0.16 * ink.z;
    if spot.part == Part::Base {
        let bare = step(27.0, 28.5, spot.radius() + 1.2 * fractal(at / 6.0, 3, 57));
        let grain = CLAY * (1.0 + 0.35 * fractal(at / 2.0, 3, 58));
        color = color.lerp(grain, bare);
        roughness = mix(roughness, 0.85, bare);
    }
    let stained = crackle(spot) * (0.34 + 0.5 * fractal(at / 30.0, 3, 59)).clamp(0.06, 0.75);
    color *= DVec3::ONE.lerp(DVec3::new(0.50, 0.37, 0.25), stained);
    let iron = spots(at / 9.0, 0.22, 0.07, 60);
    color *= DVec3::ONE.lerp(DVec3::new(0.30, 0.19, 0.11), 0.8 * iron);
    let dirt = dirt(spot);
    color = color.lerp(DIRT * color.max_element().max(0.25), 0.55 * dirt);
    let worn = wear(spot) * 0.85;
    color = color.lerp(CLAY * (1.0 + 0.3 * streak), worn);
    roughness += 0.25 * stained + 0.45 * dirt + 0.5 * worn;
    Finish { color, occlusion: 1.0, roughness: roughness.clamp(0.05, 1.0), metallic: 0.0 }
}

fn gilding(spot: &Spot) -> Finish {
    let at = spot.position;
    let tarnish =
        (step(-0.03, 0.14, spot.hollow) + 0.45 * fractal(at / 7.0, 4, 71)).clamp(0.0, 1.0);
    let worn = wear(spot);
    let tone = 1.0 + 0.14 * fractal(at / 14.0, 3, 72) + 0.06 * fractal(at / 1.5, 2, 73);
    let mut color = GOLD * tone;
    color = color.lerp(DVec3::new(0.80, 0.77, 0.70), 0.45 * worn);
    color = color.lerp(DVec3::new(0.21, 0.11, 0.045), 0.75 * tarnish);
    let roughness = 0.27 + 0.10 * fractal(at / 5.0, 3, 74) + 0.33 * tarnish;
    Finish {
        color,
        occlusion: 1.0,
        roughness: roughness.clamp(0.1, 1.0),
        metallic: 1.0 - 0.35 * tarnish,
    }
}

/// The inside of the spout: dark and dull.
fn bore(spot: &Spot) -> Finish {
    let color = DVec3::new(0.035, 0.022, 0.014) * (1.0 + 0.4 * fractal(spot.position / 2.0, 2, 81));
    Finish { color, occlusion: 1.0, roughness: 0.9, metallic: 0.0 }
}

/// The fine relief that the normal map carries, millimetres above the mesh.
pub(crate) fn height(decor: &Decor, spot: &Spot) -> f64 {
    let at = spot.position;
    match spot.part {
        Part::Bore => 0.0,
        part if part.is_metal() => {
            let hammered = 0.16 * fractal(at / 4.5, 2, 75);
            let turned = 0.03 * (spot.along * 3.1).sin();
            hammered + turned - 0.05 * step(0.45, 0.7, fractal(at / 1.5, 1, 76).abs())
        }
        _ => {
            let ink = decor.ink(spot);
            let peel = 0.035 * fractal(at / 4.0, 2, 61);
            let thick = if decor.in_frieze(spot) { 0.9 } else { 0.36 };
            peel + thick * ink.w - 0.07 * crackle(spot) - 0.25 * wear(spot)
        }
    }
}
