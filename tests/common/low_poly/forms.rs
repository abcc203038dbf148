//! The forms that props are put together from. Closed ones have their faces outward; what stands
//! does so on y = 0.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};

use super::solid::Solid;

/// Where a surface of revolution has hard edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edges {
    /// Nowhere.
    Smooth,
    /// Where its profile bends.
    Bands,
    /// Everywhere.
    Facets,
}

/// A point on a circle about the origin of a plane, the same to the bit after a turn.
pub(crate) fn on_circle(radius: f32, at: usize, of: usize) -> Vec2 {
    let (sin, cos) = ((at % of) as f32 / of as f32 * TAU).sin_cos();
    radius * vec2(cos, sin)
}

/// A box on the ground, of twelve triangles.
pub(crate) fn block(x: f32, y: f32, z: f32) -> Solid {
    let mut solid = Solid::default();
    // Right, up and outward, right-handed.
    let sides = [
        [Vec3::NEG_Z, Vec3::Y, Vec3::X],
        [Vec3::Z, Vec3::Y, Vec3::NEG_X],
        [Vec3::X, Vec3::NEG_Z, Vec3::Y],
        [Vec3::X, Vec3::Z, Vec3::NEG_Y],
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z],
    ];
    for [right, up, out] in sides {
        let corner = |r: f32, u: f32| (r * right + u * up + out) * 0.5 + vec3(0.0, 0.5, 0.0);
        solid.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    }
    solid.scaled(x, y, z)
}

/// A square bar of twelve triangles from one point to another.
pub(crate) fn bar(from: Vec3, to: Vec3, width: f32) -> Solid {
    let turn = glam::Quat::from_rotation_arc(Vec3::Y, (to - from).normalize());
    block(width, (to - from).length(), width).mapped(|point| turn * point + from)
}

/// A surface of `columns` × `rows` quads through points that a function of column and row tells,
/// seen from where columns go right and rows up.
pub(crate) fn sheet(
    columns: usize,
    rows: usize,
    edges: Edges,
    at: impl Fn(usize, usize) -> Vec3,
) -> Solid {
    let mut solid = Solid::default();
    let mut group = solid.group();
    for row in 0..rows {
        if edges == Edges::Bands {
            group = solid.group();
        }
        for column in 0..columns {
            if edges == Edges::Facets {
                group = solid.group();
            }
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[c, r]| [column + c, row + r]);
            let uv =
                |[c, r]: [usize; 2]| vec2(c as f32 / columns as f32, 1.0 - r as f32 / rows as f32);
            solid.quad_at(group, corners.map(|[c, r]| at(c, r)), corners.map(uv));
        }
    }
    solid
}

/// A surface of revolution about y through radii and heights, from the bottom to the top.
pub(crate) fn lathe(profile: &[[f32; 2]], sides: usize, edges: Edges) -> Solid {
    sheet(sides, profile.len() - 1, edges, |column, row| {
        let [radius, height] = profile[row];
        let [x, z] = on_circle(radius, column, sides).to_array();
        vec3(x, height, -z)
    })
}

/// A round or many-sided rod on the ground, closed, of 4 · `sides` triangles.
pub(crate) fn rod(bottom: f32, top: f32, height: f32, sides: usize) -> Solid {
    lathe(&[[0.0, 0.0], [bottom, 0.0], [top, height], [0.0, height]], sides, Edges::Bands)
}

/// A closed ball about the origin of 2 · `segments` · (`rings` − 1) triangles.
pub(crate) fn ball(radius: f32, segments: usize, rings: usize) -> Solid {
    let ring = |at: usize| {
        let [y, x] = on_circle(radius, at, 2 * rings).to_array();
        [if at.is_multiple_of(rings) { 0.0 } else { x }, -y]
    };
    lathe(&(0..=rings).map(ring).collect::<Vec<_>>(), segments, Edges::Smooth)
}

/// A closed ring about y of radii `major` and `minor`, of 2 · `around` · `sides` triangles.
pub(crate) fn ring(major: f32, minor: f32, around: usize, sides: usize) -> Solid {
    let at = |i: usize| (vec2(major, 0.0) + on_circle(minor, i, sides)).to_array();
    lathe(&(0..=sides).map(at).collect::<Vec<_>>(), around, Edges::Smooth)
}

/// A flat single quad in the plane z = 0 on the ground.
pub(crate) fn card(width: f32, height: f32) -> Solid {
    let mut solid = Solid::default();
    let x = width / 2.0;
    let corners = [[-x, 0.0], [x, 0.0], [x, height], [-x, height]];
    solid.quad(corners.map(|[x, y]| vec3(x, y, 0.0)));
    solid
}

/// A closed skin over outlines of as many points each, counterclockwise from where it ends.
pub(crate) fn loft(outlines: &[Vec<Vec3>], edges: Edges) -> Solid {
    let sides = outlines[0].len();
    let mut solid =
        sheet(sides, outlines.len() - 1, edges, |column, row| outlines[row][column % sides]);
    let [first, last] = [&outlines[0], &outlines[outlines.len() - 1]];
    cap(&mut solid, &first.iter().rev().copied().collect::<Vec<_>>());
    cap(&mut solid, last);
    solid
}

/// Closes an outline with a fan about its mean.
fn cap(solid: &mut Solid, outline: &[Vec3]) {
    let (group, count) = (solid.group(), outline.len());
    let center = outline.iter().sum::<Vec3>() / count as f32;
    for at in 0..count {
        let uv = |at| Vec2::splat(0.5) + on_circle(0.5, at, count);
        let points = [center, outline[at], outline[(at + 1) % count]];
        solid.triangle(group, points, [Vec2::splat(0.5), uv(at), uv(at + 1)]);
    }
}

/// A round closed tube along a path.
pub(crate) fn tube(path: &[Vec3], radius: f32, sides: usize) -> Solid {
    let mut across = (path[1] - path[0]).any_orthonormal_vector();
    let outline = |at: usize| {
        let [before, after] = [path[at.saturating_sub(1)], path[(at + 1).min(path.len() - 1)]];
        let along = (after - before).normalize();
        across = (across - across.dot(along) * along).normalize();
        let up = along.cross(across);
        let point = |side| {
            let [x, y] = on_circle(radius, side, sides).to_array();
            path[at] + x * across + y * up
        };
        (0..sides).map(point).collect()
    };
    loft(&(0..path.len()).map(outline).collect::<Vec<_>>(), Edges::Smooth)
}

/// A closed prism between z = ∓`depth` / 2 over an outline that its mean sees whole,
/// counterclockwise.
pub(crate) fn prism(outline: &[Vec2], depth: f32) -> Solid {
    let at = |z: f32| outline.iter().map(|p| p.extend(z)).collect();
    let facets = [at(-depth / 2.0), at(depth / 2.0)];
    loft(&facets, Edges::Facets)
}

/// A prism with a hole through it, whose outline has as many points.
pub(crate) fn hollow_prism(outer: &[Vec2], inner: &[Vec2], depth: f32) -> Solid {
    let count = outer.len();
    let z = depth / 2.0;
    let strip = |near: &[Vec2], near_z: f32, far: &[Vec2], far_z: f32| {
        sheet(count, 1, Edges::Facets, |column, row| {
            let (outline, z) = if row == 0 { (near, near_z) } else { (far, far_z) };
            outline[column % count].extend(z)
        })
    };
    let walls = [strip(outer, -z, outer, z), strip(inner, z, inner, -z)];
    let faces = [strip(outer, z, inner, z), strip(inner, -z, outer, -z)];
    Solid::of(walls).with(Solid::of(faces))
}

/// A hole in the middle of a cell of a plate: its width over the cell's and its corners, a
/// multiple of four.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hole(pub(crate) f32, pub(crate) usize);

/// A plate on the ground in the plane z = 0, of `cells` across and up, with holes. With a
/// thickness it is closed, else a single sheet that faces z.
pub(crate) fn plate(
    size: [f32; 2],
    thickness: f32,
    cells: [usize; 2],
    hole: impl Fn(usize, usize) -> Option<Hole>,
) -> Solid {
    let mut solid = Solid::default();
    let front = solid.group();
    let back = solid.group();
    let z = thickness / 2.0;
    let corner = |c: usize, r: usize| {
        vec2(size[0] * (c as f32 / cells[0] as f32 - 0.5), size[1] * (r as f32 / cells[1] as f32))
    };
    let uv = |p: Vec2| vec2(p.x / size[0] + 0.5, 1.0 - p.y / size[1]);
    for (c, r) in (0..cells[1]).flat_map(|r| (0..cells[0]).map(move |c| (c, r))) {
        let rim = [[1, 1], [0, 1], [0, 0], [1, 0]].map(|[x, y]| corner(c + x, r + y));
        let (flat, inner) = cell(rim, hole(c, r));
        for [a, b, c] in flat {
            let uvs = [a, b, c].map(uv);
            solid.triangle(front, [a, b, c].map(|p| p.extend(z)), uvs);
            if thickness > 0.0 {
                let points = [a, c, b].map(|p| p.extend(-z));
                solid.triangle(back, points, [uvs[0], uvs[2], uvs[1]]);
            }
        }
        if thickness > 0.0 {
            for at in 0..inner.len() {
                wall(&mut solid, inner[(at + 1) % inner.len()], inner[at], z);
            }
        }
    }
    if thickness > 0.0 {
        let [columns, rows] = cells;
        for c in 0..columns {
            wall(&mut solid, corner(c, 0), corner(c + 1, 0), z);
            wall(&mut solid, corner(c + 1, rows), corner(c, rows), z);
        }
        for r in 0..rows {
            wall(&mut solid, corner(columns, r), corner(columns, r + 1), z);
            wall(&mut solid, corner(0, r + 1), corner(0, r), z);
        }
    }
    solid
}

/// A quad from one side of a plate to the other.
fn wall(solid: &mut Solid, from: Vec2, to: Vec2, z: f32) {
    solid.quad([from.extend(-z), to.extend(-z), to.extend(z), from.extend(z)]);
}

/// The triangles of a cell, counterclockwise from its upper right corner, and the points around
/// its hole.
fn cell(rim: [Vec2; 4], hole: Option<Hole>) -> (Vec<[Vec2; 3]>, Vec<Vec2>) {
    let Some(Hole(share, count)) = hole else {
        return (vec![[rim[0], rim[1], rim[2]], [rim[0], rim[2], rim[3]]], Vec::new());
    };
    let center = (rim[0] + rim[2]) / 2.0;
    // A square hole touches with its corners what a round one would have around it.
    let reach = share / if count == 4 { std::f32::consts::FRAC_1_SQRT_2 } else { 1.0 };
    let inner: Vec<Vec2> = (0..count)
        .map(|at| center + on_circle(reach, 2 * at + count / 4, 2 * count) * (rim[0] - center))
        .collect();
    let mut flat = Vec::new();
    let side = count / 4;
    for from in 0..4 {
        let at = |step: usize| inner[(from * side + step) % count];
        let [near, far] = [rim[from], rim[(from + 1) % 4]];
        flat.extend((0..side / 2).map(|step| [near, at(step + 1), at(step)]));
        flat.push([near, far, at(side / 2)]);
        flat.extend((side / 2..side).map(|step| [far, at(step + 1), at(step)]));
    }
    (flat, inner)
}
