//! Shape tests of a surviving triangle: rotation, slivers and folds in UV.

use glam::{DVec2, DVec3};

/// Below this quality a surviving triangle is a sliver; an equilateral one has quality 1.
const SLIVER: f64 = 0.05;
/// A sliver must keep this share of the quality that it had before.
///
/// If it must keep all, thin tubes and wires get stuck and their descent goes elsewhere: at 12.5 % a
/// ship's RMS distance is 4.9e-3 of the diagonal instead of 1.8e-3. If half, a string of a racquet
/// can't join two of its segments, whose triangles are then half as thick as they were, and gives up
/// its ends instead. RMS distance at 12.5 and 6.25 % over that at a half: 0.53 and 0.62 with a fifth,
/// 0.52 and 0.34 with a twentieth, 0.53 and 0.33 with nothing. Other models are within 2 %, and so is
/// luminance.
const KEPT_QUALITY: f64 = 0.05;

fn cross(p: [DVec3; 3]) -> DVec3 {
    (p[1] - p[0]).cross(p[2] - p[0])
}

/// Whether a triangle turns by more than the angle of `cosine`. One without area has no direction to
/// turn from.
pub(crate) fn turns(before: [DVec3; 3], after: [DVec3; 3], cosine: f64) -> bool {
    let (old, new) = (cross(before), cross(after));
    old.dot(new) < cosine * old.length() * new.length()
}

/// Area over squared sides, 1 for an equilateral triangle.
fn quality(p: [DVec3; 3]) -> f64 {
    let sides =
        p[0].distance_squared(p[1]) + p[1].distance_squared(p[2]) + p[2].distance_squared(p[0]);
    if sides > 0.0 { 2.0 * 3f64.sqrt() * cross(p).length() / sides } else { 0.0 }
}

/// Whether a triangle becomes a sliver that has lost too much of its quality.
pub(crate) fn is_worse_sliver(before: [DVec3; 3], after: [DVec3; 3]) -> bool {
    let after = quality(after);
    after < SLIVER && after < KEPT_QUALITY * quality(before)
}

/// Below this share of its longest side squared, the UV area of a triangle has no sign: rounding to
/// `f32` could turn it over.
const FLAT_UV: f64 = 1e-6;

/// Whether a triangle's UV area changes or loses its sign. One that has none may take either.
pub(crate) fn folds(before: [DVec2; 3], after: [DVec2; 3]) -> bool {
    let side = |t: [DVec2; 3]| {
        let [a, b, c] = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
        let longest = a.length_squared().max(b.length_squared()).max(c.length_squared());
        let area = b.perp_dot(c);
        if area.abs() > FLAT_UV * longest { area.signum() } else { 0.0 }
    };
    let was = side(before);
    was != 0.0 && side(after) != was
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    fn tip(z: f64, y: f64) -> [DVec3; 3] {
        [DVec3::ZERO, DVec3::X, DVec3::new(0.0, y, z)]
    }

    #[test]
    fn a_triangle_turns_past_75_degrees() {
        let turns = |before, after| turns(before, after, 75f64.to_radians().cos());
        let turned = |degrees: f64| tip(degrees.to_radians().sin(), degrees.to_radians().cos());
        assert!(!turns(FLAT, turned(74.0)));
        assert!(turns(FLAT, turned(76.0)));
        assert!(turns(FLAT, [FLAT[1], FLAT[0], FLAT[2]]), "over");
        assert!(!turns([DVec3::ZERO; 3], FLAT), "from nothing");
    }

    #[test]
    fn quality_is_one_for_equal_sides_and_zero_for_a_line() {
        let equal = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 3f64.sqrt() / 2.0, 0.0)];
        assert!((quality(equal) - 1.0).abs() < 1e-12);
        assert_eq!(quality([DVec3::ZERO, DVec3::X, DVec3::X * 2.0]), 0.0);
    }

    #[test]
    fn a_sliver_may_stay_one_but_not_come_to_nothing() {
        assert!(is_worse_sliver(FLAT, tip(0.0, 0.001)));
        assert!(!is_worse_sliver(FLAT, tip(0.0, 0.05)), "thin, but a twentieth of what it was");
        assert!(!is_worse_sliver(tip(0.0, 0.012), tip(0.0, 0.001)));
    }

    #[test]
    fn a_uv_triangle_folds_when_its_sign_changes() {
        let upright = [DVec2::ZERO, DVec2::X, DVec2::Y];
        let mirrored = [DVec2::ZERO, DVec2::Y, DVec2::X];
        assert!(folds(upright, mirrored) && folds(mirrored, upright));
        assert!(!folds(mirrored, mirrored.map(|uv| uv * 2.0)));
        assert!(!folds([DVec2::ZERO; 3], mirrored), "no area, no side");
        let thin = [DVec2::ZERO, DVec2::X, DVec2::new(0.5, 1e-7)];
        assert!(folds(upright, thin) && !folds(thin, mirrored), "lost, then free");
    }
}
