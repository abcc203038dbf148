//! The background of a picture that no mesh tells about: its colors, or its alpha.
//!
//! Where alpha tells, colors spread under alpha 0 and alpha stays to the bit: what filters read of a
//! cutout is its own color, and no halo of what was painted around it.

use image::{DynamicImage, ImageFormat};
use seamwise_texture::{Background, Role, Validity, alpha_tells, seen_texels};

use super::options;

/// Backgrounds that were found and not given hold this share of an atlas, unless something is odd.
const PLAUSIBLE: [f64; 2] = [0.05, 0.9];

/// The most that a texel differs from the background's color: half a step of 8 bits where files keep their
/// texels, three steps and a half where a lossy codec may have changed them.
const TOLERANCE: f32 = 0.5 / 255.0;
const LOSSY_TOLERANCE: f32 = 3.5 / 255.0;

/// The tolerance for a file of this format.
pub(super) fn tolerance(format: ImageFormat) -> f32 {
    let is_lossy = matches!(format, ImageFormat::Jpeg | ImageFormat::WebP);
    if is_lossy { LOSSY_TOLERANCE } else { TOLERANCE }
}

/// The background of a picture.
pub(super) struct Found {
    /// The texels that have none of its colors, rims that are stained by it among them.
    pub(super) charts: Validity,
    /// Whether those rims are invalid too.
    pub(super) is_blended: bool,
    /// Whether alpha 0 is background, under which colors spread.
    pub(super) spreads: bool,
    /// A note for people of all that was found.
    pub(super) note: String,
    /// The odd thing about it, if there is one.
    pub(super) doubt: Option<String>,
}

impl Found {
    /// The background of a picture, found or given; `None` if there is none. `tolerance` is how far its
    /// texels may be from a color, and `role` what they mean as far as that is known.
    pub(super) fn of(
        texels: &DynamicImage,
        background: &options::Background,
        tolerance: f32,
        role: Role,
    ) -> Option<Self> {
        let colors = colors(texels, background, tolerance);
        let spreads = spreads(texels, background, role);
        if colors.is_none() && !spreads {
            return None;
        }
        let size = [texels.width() as usize, texels.height() as usize];
        let all = || Validity::from_flags(size[0], size[1], vec![true; size[0] * size[1]]);
        let charts = colors.as_ref().map_or_else(all, |colors| colors.charts().clone());
        let is_blended = colors.as_ref().is_some_and(Background::is_blended);
        let share =
            |validity: &Validity| validity.invalid() as f64 / (size[0] * size[1]).max(1) as f64;
        let mut parts = Vec::new();
        if spreads {
            let hidden = 100.0 * share(&seen_texels(texels));
            parts
                .push(format!("alpha 0, {hidden:.1} % of it: colors spread under it, alpha stays"));
        }
        let mut doubt = None;
        if let Some(colors) = &colors {
            let share = share(&charts);
            let names = names(colors.colors());
            let rims = if is_blended {
                "; the rims of charts, which it stains, are filled too"
            } else {
                ""
            };
            parts.push(format!("{names}, {:.1} % of it{rims}", 100.0 * share));
            let is_auto = *background == options::Background::Auto;
            let is_odd = is_auto && !(PLAUSIBLE[0]..=PLAUSIBLE[1]).contains(&share);
            doubt = is_odd.then(|| {
                let [least, most] = PLAUSIBLE.map(|share| 100.0 * share);
                format!(
                    "{names} is taken for what lies around the charts, {:.1} % of the picture, where \
                     {least} to {most} % is usual: look at the result (--diff), or give --mesh, \
                     --mask or --background",
                    100.0 * share
                )
            });
        }
        let note = format!("background: {}", parts.join("; "));
        Some(Self { charts, is_blended, spreads, note, doubt })
    }

    /// The texels to trust, by color and by alpha.
    pub(super) fn shown(&self, texels: &DynamicImage) -> Validity {
        let mut shown =
            if self.is_blended { self.charts.without_rims() } else { self.charts.clone() };
        if self.spreads {
            shown.intersect(&seen_texels(texels));
        }
        shown
    }
}

/// The colors that are background.
fn colors(
    texels: &DynamicImage,
    background: &options::Background,
    tolerance: f32,
) -> Option<Background> {
    match background {
        options::Background::Auto => Background::detect(texels, tolerance),
        options::Background::Colors(colors) => {
            let seen: Vec<[f32; 4]> = colors.iter().copied().filter(|c| c[3] > 0.0).collect();
            (!seen.is_empty()).then(|| Background::of_colors(texels, &seen, tolerance))
        }
        options::Background::Alpha | options::Background::None => None,
    }
}

/// Whether colors spread under alpha 0.
fn spreads(texels: &DynamicImage, background: &options::Background, role: Role) -> bool {
    let is_named = |colors: &[[f32; 4]]| colors.iter().any(|color| color[3] == 0.0);
    match background {
        options::Background::Auto => alpha_tells(texels, role),
        options::Background::Alpha => alpha_tells(texels, Role::Color),
        options::Background::Colors(colors) => is_named(colors) && alpha_tells(texels, Role::Color),
        options::Background::None => false,
    }
}

/// Colors as they may be given, the first few of many.
fn names(colors: &[[f32; 4]]) -> String {
    const NAMED: usize = 4;
    let in_bytes = colors.iter().flatten().all(|v| (0.0..=1.0).contains(v));
    let name = |color: &[f32; 4]| {
        if !in_bytes {
            return format!("{color:?}");
        }
        let bytes = color.map(|v| (255.0 * v).round() as u8);
        let digits = if bytes[3] == 255 { 3 } else { 4 };
        let hex: String = bytes[..digits].iter().map(|byte| format!("{byte:02x}")).collect();
        format!("#{hex}")
    };
    let named: Vec<String> = colors.iter().take(NAMED).map(name).collect();
    let more = match colors.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    named.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    fn found(texel: fn(u32, u32) -> [u8; 4], background: &str) -> Option<Found> {
        let image = RgbaImage::from_fn(32, 32, |x, y| Rgba(texel(x, y)));
        Found::of(&image.into(), &background.parse().unwrap(), 0.0, Role::Color)
    }

    fn leaf(x: u32, y: u32) -> [u8; 4] {
        let is_leaf = (8..24).contains(&x) && (8..24).contains(&y);
        if is_leaf { [40, 90 + x as u8, 30 + y as u8, 255] } else { [255, 255, 255, 0] }
    }

    #[test]
    fn alpha_is_background_if_it_tells_or_is_named() {
        for background in ["auto", "alpha", "#ffffff00"] {
            let found = found(leaf, background).unwrap();
            assert!(found.spreads && found.charts.invalid() == 0, "{background}");
            assert!(found.note.contains("alpha 0, 75.0 %"), "{}", found.note);
        }
        assert!(found(leaf, "none").is_none());
        let white = found(leaf, "#ffffff").unwrap();
        assert!(!white.spreads && white.charts.invalid() == 0);
    }

    #[test]
    fn what_was_found_is_named_with_its_share_and_a_doubt_if_that_is_odd() {
        let on_magenta = |x: u32, y: u32| {
            let [r, g, b, alpha] = leaf(x, y);
            if alpha == 0 { [255, 0, 255, 255] } else { [r, g, b, 255] }
        };
        let own = found(on_magenta, "auto").unwrap();
        assert_eq!(own.note, "background: #ff00ff, 75.0 % of it");
        assert!(own.doubt.is_none());
        let speck = |x: u32, y: u32| {
            let is_chart = (8..12).contains(&x) && (8..12).contains(&y);
            if is_chart { [1, x as u8, y as u8, 255] } else { [255, 0, 255, 255] }
        };
        let odd = found(speck, "auto").unwrap().doubt.unwrap();
        assert!(
            odd.contains("#ff00ff") && odd.contains("98.4 %") && odd.contains("--mask"),
            "{odd}"
        );
        assert!(found(speck, "#ff00ff").unwrap().doubt.is_none(), "it was given");
        let many = [[0.0; 4]; 6];
        assert!(names(&many).ends_with("#00000000 and 2 more"), "{}", names(&many));
        assert_eq!(names(&[[2.0, 0.0, 0.5, 1.0]]), "[2.0, 0.0, 0.5, 1.0]");
    }
}
