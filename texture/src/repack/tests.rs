//! Layouts of whole surfaces.

use std::collections::HashMap;

use glam::{DVec2, Vec2, Vec3};
use proptest::prelude::*;

use super::*;
use crate::raster::{UvTriangle, Window, to_texels};

/// A surface that owns its arrays; one group unless told otherwise.
#[derive(Clone, Debug, Default)]
struct Made {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    groups: Vec<u32>,
}

impl Made {
    fn mesh(&self) -> UvMesh<'_> {
        let Self { positions, uvs, triangles, groups } = self;
        UvMesh { positions, uvs, triangles, groups }
    }

    /// A grid of `columns` × `rows` squares that share their vertices.
    fn grid(
        &mut self,
        [columns, rows]: [u32; 2],
        place: impl Fn(f32, f32) -> ([f32; 3], [f32; 2]),
        group: u32,
    ) {
        let first = self.positions.len() as u32;
        for y in 0..=rows {
            for x in 0..=columns {
                let (position, uv) = place(x as f32, y as f32);
                self.positions.push(position.into());
                self.uvs.push(uv.into());
            }
        }
        for y in 0..rows {
            for x in 0..columns {
                let a = first + y * (columns + 1) + x;
                let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
                self.triangles.extend([[a, b, c], [a, c, d]]);
                self.groups.extend([group; 2]);
            }
        }
    }
}

/// Checks what holds for any layout.
fn check_layout(made: &Made, layout: &Repacked, options: &RepackOptions) {
    let RepackOptions { size, padding, .. } = *options;
    assert_eq!(layout.triangles.len(), made.triangles.len());
    for (new, old) in layout.triangles.iter().zip(&made.triangles) {
        assert_eq!(new.map(|v| layout.vertices[v as usize]), *old);
    }
    let margin = (padding / 2) as f32 / size as f32;
    for uv in &layout.uvs {
        assert!(uv.min_element() >= margin && uv.max_element() <= 1.0 - margin, "{uv}");
    }
    let mut owners: HashMap<(i64, i64), usize> = HashMap::new();
    let mut reached: Vec<(i64, i64, u32)> = Vec::new();
    let corners =
        |t: usize| layout.triangles[t].map(|v| to_texels(layout.uvs[v as usize], [size; 2]));
    for t in 0..layout.triangles.len() {
        let Some(shape) = UvTriangle::new(corners(t)) else { continue };
        let [a, b, c] = corners(t);
        // Thinner than UVs are exact, it may come out either way.
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let rounding = 4.0 * f64::from(f32::EPSILON) * size as f64;
        assert!((b - a).perp_dot(c - a) <= rounding * longest, "mirrored: {:?}", corners(t));
        shape.texels(&Window { x: -9..size as i64 + 9, y: -9..size as i64 + 9 }, |texel| {
            reached.push((texel.x, texel.y, layout.triangle_charts[t]));
            if let Some(other) = owners.insert((texel.x, texel.y), t) {
                let centre = DVec2::new(texel.x as f64 + 0.5, texel.y as f64 + 0.5);
                let theirs = UvTriangle::new(corners(other)).unwrap().barycentrics(centre);
                for weights in [theirs, texel.barycentrics] {
                    assert!(weights.contains(&0.0), "{t} and {other} at {centre}");
                }
            }
        });
    }
    check_gaps(&reached, padding as i64);
    assert_eq!(layout.coverage, owners.len() as f64 / (size * size) as f64);
}

/// Texels of different charts lie apart.
fn check_gaps(reached: &[(i64, i64, u32)], padding: i64) {
    let owner: HashMap<(i64, i64), u32> = reached.iter().map(|&(x, y, c)| ((x, y), c)).collect();
    for &(x, y, chart) in reached {
        for v in y - padding..=y + padding {
            for u in x - padding..=x + padding {
                let other = owner.get(&(u, v)).copied().unwrap_or(chart);
                assert_eq!(other, chart, "charts at {x}, {y} and {u}, {v}");
            }
        }
    }
}

fn small(size: usize, padding: usize) -> RepackOptions {
    RepackOptions { size, padding, ..RepackOptions::default() }
}

#[test]
fn a_square_fills_the_atlas() {
    let mut made = Made::default();
    made.grid([4, 4], |x, y| ([x, -y, 0.0], [x * 0.1, y * 0.1]), 0);
    let options = small(64, 4);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert_eq!(layout.charts, 1);
    assert!(layout.coverage > 0.85, "{}", layout.coverage);
    assert!((layout.texels_per_unit - 15.0).abs() < 0.3, "{}", layout.texels_per_unit);
}

#[test]
fn halves_mirrored_onto_each_other_part_and_neither_is_mirrored() {
    let mut made = Made::default();
    made.grid([4, 3], |x, y| ([x, -y, 0.0], [(x - 2.0).abs(), y]), 0);
    let options = small(128, 2);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert_eq!(layout.charts, 2);
}

#[test]
fn a_strip_that_winds_over_itself_is_cut_where_it_overlaps() {
    // Two and a half times around a ring.
    let mut made = Made::default();
    let ring = |x: f32, y: f32| {
        let (sin, cos) = (x % 12.0 * std::f32::consts::TAU / 12.0).sin_cos();
        let radius = 1.0 + y;
        ([radius * cos, -radius * sin, 0.1 * x], [radius * cos, radius * sin])
    };
    made.grid([30, 1], ring, 0);
    let options = small(128, 2);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert_eq!(layout.charts, 3);
}

#[test]
fn charts_have_the_density_of_the_surface_or_what_is_asked_for() {
    // The same square in three groups, each laid out at another scale.
    let mut made = Made::default();
    for (group, scale) in [(0, 1.0), (1, 30.0), (2, 0.01)] {
        made.grid([3, 3], |x, y| ([x, -y, group as f32], [x * scale, y * scale]), group);
    }
    let area = |layout: &Repacked, group: usize| {
        let own = made.groups.iter().zip(&layout.triangles).filter(|(g, _)| **g == group as u32);
        own.map(|(_, t)| {
            let [a, b, c] = t.map(|v| layout.uvs[v as usize]);
            (b - a).perp_dot(c - a).abs()
        })
        .sum::<f32>()
    };
    let layout = repack(&made.mesh(), &small(256, 4)).unwrap();
    assert!((area(&layout, 1) / area(&layout, 0) - 1.0).abs() < 1e-3);
    assert!((area(&layout, 2) / area(&layout, 0) - 1.0).abs() < 1e-3);
    let options = RepackOptions { density: vec![1.0, 2.0], ..small(256, 4) };
    let layout = repack(&made.mesh(), &options).unwrap();
    assert!((area(&layout, 1) / area(&layout, 0) - 4.0).abs() < 1e-3);
    assert!((area(&layout, 2) / area(&layout, 0) - 1.0).abs() < 1e-3);
}

#[test]
fn a_cube_without_uvs_unfolds_to_its_six_sides() {
    let mut made = Made::default();
    let corner = |i: u32| [0, 1, 2].map(|axis| (i >> axis & 1) as f32).into();
    made.positions = (0..8).map(corner).collect();
    made.uvs = vec![Vec2::ZERO; 8];
    let sides: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    made.triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    made.groups = vec![0; 12];
    let options = small(128, 2);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert_eq!(layout.charts, 6);
    assert!(layout.coverage > 0.55, "{}", layout.coverage);
}

#[test]
fn what_has_no_area_gets_a_texel() {
    let mut made = Made::default();
    made.grid([2, 2], |x, y| ([x, -y, 0.0], [x, y]), 0);
    let spots = [[0.0; 3], [f32::NAN; 3], [f32::INFINITY, 0.0, 1.0]];
    for spot in spots {
        let first = made.positions.len() as u32;
        made.positions.extend([spot; 3].map(Vec3::from));
        made.uvs.extend([Vec2::NAN; 3]);
        made.triangles.push([first, first + 1, first + 2]);
        made.groups.push(0);
    }
    let options = small(32, 2);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert_eq!(layout.charts, 1 + spots.len());
    let texel = |t: usize| (layout.uvs[layout.triangles[t][0] as usize] * 32.0).floor();
    assert!(texel(8) != texel(9) && texel(9) != texel(10));
}

#[test]
fn a_long_strip_does_not_make_all_else_small() {
    let mut made = Made::default();
    made.grid([200, 1], |x, y| ([x, -y, 0.0], [x, y]), 0);
    let options = small(128, 1);
    let layout = repack(&made.mesh(), &options).unwrap();
    check_layout(&made, &layout, &options);
    assert!(layout.charts > 8 && layout.coverage > 0.6, "{} {}", layout.charts, layout.coverage);
}

#[test]
fn too_many_charts_and_bad_meshes_are_told() {
    let mut made = Made::default();
    for i in 0..40 {
        made.grid([1, 1], |x, y| ([x, -y, i as f32], [x, y]), 0);
    }
    let error = repack(&made.mesh(), &small(16, 2)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "40 charts do not fit an atlas of 16×16 texels with 2 between them"
    );
    for options in [small(0, 0), small(8, 8), small(8, usize::MAX)] {
        assert!(matches!(repack(&made.mesh(), &options), Err(Error::Full { .. })));
    }
    let options = RepackOptions { density: vec![f64::NAN], ..small(64, 1) };
    assert!(matches!(repack(&made.mesh(), &options), Err(Error::Mesh { .. })));
    for spoil in [
        |made: &mut Made| made.triangles[3][1] = 1 << 20,
        |made: &mut Made| made.groups.push(0),
        |made: &mut Made| made.uvs.push(Vec2::ZERO),
    ] {
        let mut made = made.clone();
        spoil(&mut made);
        assert!(matches!(repack(&made.mesh(), &small(64, 1)), Err(Error::Mesh { .. })));
    }
}

#[test]
fn nothing_is_laid_out_as_nothing() {
    let layout = repack(&Made::default().mesh(), &small(16, 2)).unwrap();
    assert_eq!((layout.charts, layout.coverage, layout.uvs.len()), (0, 0.0, 0));
}

#[test]
fn padding_doubles_with_each_mip() {
    assert_eq!([0, 1, 5].map(padding_for_mips), [1, 2, 32]);
    assert_eq!(padding_for_mips(99), usize::MAX);
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => (0..8u8).prop_map(f32::from),
        8 => -2.0..2.0f32,
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, 1e30, -1e-30, f32::MAX, 1e-42]),
    ]
}

prop_compose! {
    fn soup()(
        vertices in prop::collection::vec(([coordinate(), coordinate(), coordinate()], [coordinate(), coordinate()]), 3..40),
        corners in prop::collection::vec((prop::array::uniform3(0..40u32), 0..2u32), 1..60),
    ) -> Made {
        let count = vertices.len() as u32;
        let (positions, uvs): (Vec<[f32; 3]>, Vec<[f32; 2]>) = vertices.into_iter().unzip();
        let (triangles, groups): (Vec<[u32; 3]>, Vec<u32>) = corners.into_iter().unzip();
        Made {
            positions: positions.into_iter().map(Vec3::from).collect(),
            uvs: uvs.into_iter().map(Vec2::from).collect(),
            triangles: triangles.into_iter().map(|t| t.map(|v| v % count)).collect(),
            groups,
        }
    }
}

prop_compose! {
    /// A grid with UVs that fold over, at scales and places where rounding shows.
    fn folded()(
        shifts in prop::collection::vec([-0.8..0.8f32, -0.8..0.8f32], 81),
        place in prop::sample::select(vec![0.0f32, 100.0, 1e5]),
    ) -> Made {
        let mut made = Made::default();
        made.grid([8, 8], |x, y| {
            let [u, v] = shifts[(y * 9.0 + x) as usize];
            ([x, -y, u], [place + x + u, place + y + v])
        }, 0);
        made
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn no_texel_of_any_layout_has_two_triangles(
        made in prop_oneof![soup(), folded()],
        size in 40..160usize,
        padding in 0..3usize,
    ) {
        let options = small(size, padding);
        match repack(&made.mesh(), &options) {
            Ok(layout) => check_layout(&made, &layout, &options),
            Err(error) => prop_assert!(matches!(error, Error::Full { .. }), "{error}"),
        }
    }

    #[test]
    fn the_number_of_threads_does_not_show(made in prop_oneof![soup(), folded()]) {
        let layouts = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| repack(&made.mesh(), &small(96, 1)).ok())
        });
        prop_assert_eq!(&layouts[0], &layouts[1]);
    }
}
