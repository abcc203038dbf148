//! Light and its reflection: what a surface point sends to the eye.
//!
//! The material is glTF's metallic-roughness model (glTF 2.0 appendix B.3): Lambert and GGX with the
//! separable Smith term and Schlick's Fresnel.
//!
//! The light is a key that comes from above the camera's left shoulder, so every view is lit and
//! every view shows the relief of its normals (a key fixed in the world leaves half of the views in
//! the shade, where an error of the normals can't be seen), and a surrounding of two tones fixed in
//! the world, bright above the horizon and dark below, so nothing is black and metals have an edge
//! to reflect. Of the surrounding, with z the direction to its zenith, which is +y unless the rig
//! is turned,
//!
//! - diffuse: exactly, mix(ground, sky, (1 + n·z)/2);
//! - specular: mix(ground, sky, smoothstep(−w, w, r·z)) for the mirrored direction r, with the width
//!   w of the lobe taken as the roughness, times the fit of the environment BRDF by Karis
//!   ("Physically based shading on mobile", 2014).
//!
//! Levels are such that a white Lambert surface turned to the sky and the key sends just below 1.
//! No shadows are cast: they would add the renderer's own errors to those it measures.

use glam::Vec3;

use super::camera::Camera;

/// Radiance of the key that a white Lambert surface facing it reflects.
const KEY: f32 = 0.55;
/// Radiance above and below the horizon.
const SKY: f32 = 0.45;
const GROUND: f32 = 0.15;
/// Reflectance of a dielectric seen straight on (glTF 2.0 appendix B.2).
const DIELECTRIC: f32 = 0.04;
/// Below this the highlight falls between samples.
const MIN_ROUGHNESS: f32 = 0.045;

/// A point of a surface, seen and lit.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Linear.
    pub(super) base_color: Vec3,
    pub(super) metallic: f32,
    pub(super) roughness: f32,
    /// Share of the surrounding's light that arrives.
    pub(super) occlusion: f32,
    /// Unit, in the world.
    pub(super) normal: Vec3,
    /// Unit, from the point to the eye.
    pub(super) to_eye: Vec3,
}

/// The light of one view.
#[derive(Clone, Copy)]
pub(super) struct Light {
    /// Unit, from the surface to the key.
    to_key: Vec3,
    /// Unit, to the zenith of the surrounding.
    zenith: Vec3,
}

impl Light {
    pub(super) fn of(camera: &Camera) -> Self {
        let to_key = camera.up * 0.6 - camera.right * 0.4 - camera.forward;
        Self { to_key: to_key.normalize().as_vec3(), zenith: camera.zenith.as_vec3() }
    }

    /// The linear light that a point sends to the eye, at least 0 and without bound in a highlight.
    #[inline(always)]
    pub(super) fn reflect(&self, surface: &Surface) -> Vec3 {
        let Surface { base_color, metallic, normal, to_eye, .. } = *surface;
        let diffuse = base_color * (1.0 - metallic);
        let f0 = Vec3::splat(DIELECTRIC * (1.0 - metallic)) + base_color * metallic;
        let roughness = least(most(surface.roughness, MIN_ROUGHNESS), 1.0);
        let n_eye = most(normal.dot(to_eye), 1e-4);
        let n_key = most(normal.dot(self.to_key), 0.0);
        let around = diffuse * mix(0.5 + 0.5 * normal.dot(self.zenith))
            + environment_brdf(f0, roughness, n_eye) * self.mirrored(normal, to_eye, roughness);
        let half = normalize_or(self.to_key + to_eye, normal);
        let graze = power_5(1.0 - least(most(to_eye.dot(half), 0.0), 1.0));
        let fresnel = f0 + (Vec3::ONE - f0) * graze;
        let gloss = ggx(normal.dot(half), n_key, n_eye, roughness * roughness);
        let key = (diffuse * (Vec3::ONE - fresnel) + fresnel * gloss) * (KEY * n_key);
        around * surface.occlusion + key
    }

    /// Radiance of the surrounding in the mirrored direction, blurred by roughness.
    #[inline(always)]
    fn mirrored(&self, normal: Vec3, to_eye: Vec3, roughness: f32) -> f32 {
        let up = (normal * (2.0 * normal.dot(to_eye)) - to_eye).dot(self.zenith);
        let t = least(most(0.5 + 0.5 * up / roughness, 0.0), 1.0);
        mix(t * t * (3.0 - 2.0 * t))
    }
}

/// The greater number; the second if one is none. As the processor's own instruction says it.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser number; the second if one is none.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Held to 0…1; what is not a number is 0.
#[inline(always)]
pub(super) fn unit(value: f32) -> f32 {
    least(most(value, 0.0), 1.0)
}

/// Of length 1; `fallback` where that can't be.
#[inline(always)]
pub(super) fn normalize_or(vector: Vec3, fallback: Vec3) -> Vec3 {
    let scale = 1.0 / vector.dot(vector).sqrt();
    let scaled = vector * scale;
    let is_unit = scale > 0.0 && scale < f32::INFINITY;
    Vec3::new(
        if is_unit { scaled.x } else { fallback.x },
        if is_unit { scaled.y } else { fallback.y },
        if is_unit { scaled.z } else { fallback.z },
    )
}

/// π · D · V of GGX with the separable Smith term (glTF 2.0 appendix B.3.2), for the cosines of the
/// normal with the half vector, the light and the eye.
#[inline(always)]
fn ggx(n_half: f32, n_light: f32, n_eye: f32, alpha: f32) -> f32 {
    let squared = alpha * alpha;
    let denominator = n_half * n_half * (squared - 1.0) + 1.0;
    let smith = |cosine: f32| cosine + (squared + (1.0 - squared) * cosine * cosine).sqrt();
    let sent = squared / (denominator * denominator * smith(n_light) * smith(n_eye));
    if n_half > 0.0 { sent } else { 0.0 }
}

/// Between ground (0) and sky (1).
#[inline(always)]
fn mix(t: f32) -> f32 {
    GROUND + (SKY - GROUND) * t
}

/// The share of a uniform surrounding that GGX reflects, by Karis's fit.
#[inline(always)]
fn environment_brdf(f0: Vec3, roughness: f32, n_eye: f32) -> Vec3 {
    let x = 1.0 - roughness;
    let y = 0.0425 - 0.0275 * roughness;
    let a = least(x * x, exp2_down(9.28 * n_eye)) * x + y;
    let scale = -1.04 * a + 1.04 - 0.572 * roughness;
    let bias = 1.04 * a - 0.04 + 0.022 * roughness;
    let share = |f0: f32| most(f0 * scale + bias, 0.0);
    Vec3::new(share(f0.x), share(f0.y), share(f0.z))
}

/// 2^(−x) for x of 0…10, off by less than 1e-6: the 16th power of the series of e^(−x·ln 2 / 16).
#[inline(always)]
fn exp2_down(x: f32) -> f32 {
    let y = x * (-std::f32::consts::LN_2 / 16.0);
    let series = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y / 120.0))));
    let squared = series * series;
    let fourth = squared * squared;
    let eighth = fourth * fourth;
    eighth * eighth
}

#[inline(always)]
fn power_5(x: f32) -> f32 {
    let squared = x * x;
    squared * squared * x
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn light() -> Light {
        Light::of(&Camera::look_at(DVec3::Z, DVec3::ZERO, 0.7, 0.1))
    }

    fn surface(metallic: f32, roughness: f32, normal: Vec3) -> Surface {
        Surface {
            base_color: Vec3::ONE,
            metallic,
            roughness,
            occlusion: 1.0,
            normal: normal.normalize(),
            to_eye: Vec3::Z,
        }
    }

    fn reflect(surface: &Surface) -> f32 {
        light().reflect(surface).x
    }

    #[test]
    fn the_power_of_two_is_that_of_the_library() {
        for step in 0..=1000 {
            let x = step as f32 * 0.01;
            let found = exp2_down(x);
            assert!((found - (-x).exp2()).abs() < 1e-6, "{x}: {found}");
        }
    }

    #[test]
    fn white_and_rough_stays_below_one_and_above_black() {
        for step in 0..64 {
            let angle = step as f32 * 0.1;
            let normal = Vec3::new(angle.cos() * 0.7, angle.sin() * 0.7, 0.5);
            let sent = reflect(&surface(0.0, 1.0, normal));
            assert!((0.1..1.0).contains(&sent), "{sent}");
        }
    }

    #[test]
    fn the_lobe_of_ggx_holds_one() {
        // ∫ D (n·h) dω = 1 over the hemisphere; V·4·(n·l)(n·v) is 1 at normal incidence.
        let alpha = 0.3f32;
        let steps = 20_000;
        let integral: f32 = (0..steps)
            .map(|step| {
                let angle = (step as f32 + 0.5) / steps as f32 * std::f32::consts::FRAC_PI_2;
                let d = ggx(angle.cos(), 1.0, 1.0, alpha) * 4.0 / std::f32::consts::PI;
                d * angle.cos() * angle.sin() * std::f32::consts::TAU
            })
            .sum::<f32>()
            * std::f32::consts::FRAC_PI_2
            / steps as f32;
        assert!((integral - 1.0).abs() < 1e-3, "{integral}");
    }

    #[test]
    fn a_smooth_metal_mirrors_the_surrounding() {
        // The normal halfway to the sky and to the ground; the key lies elsewhere.
        let up = reflect(&surface(1.0, 0.0, Vec3::new(0.5, 0.5, 1.0)));
        let down = reflect(&surface(1.0, 0.0, Vec3::new(0.5, -0.5, 1.0)));
        assert!((up - SKY).abs() < 0.02 && (down - GROUND).abs() < 0.02, "{up} {down}");
    }

    #[test]
    fn occlusion_takes_the_surrounding_and_leaves_the_key() {
        let open = surface(0.0, 0.8, Vec3::Z);
        let shut = Surface { occlusion: 0.0, ..surface(0.0, 0.8, Vec3::Z) };
        let (open, shut) = (reflect(&open), reflect(&shut));
        assert!(shut > 0.3 && open - shut > 0.25);
    }

    #[test]
    fn what_has_no_length_falls_back() {
        for bad in [Vec3::ZERO, Vec3::NAN, Vec3::X * 1e30, Vec3::INFINITY] {
            assert_eq!(normalize_or(bad, Vec3::Z), Vec3::Z);
        }
        assert_eq!(normalize_or(Vec3::X * 3.0, Vec3::Z), Vec3::X);
    }

    #[test]
    fn unit_holds_to_the_range_of_a_screen() {
        assert_eq!([f32::NAN, -1.0, f32::INFINITY, 0.25].map(unit), [0.0, 0.0, 1.0, 0.25]);
    }
}
