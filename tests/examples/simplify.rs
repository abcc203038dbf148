//! Simplifies arrays of a program's own: a wavy cloth of 80,000 triangles, pinned at two corners.

use seamwise::attr::{Simplifier, Vertices};

const SIDE: u32 = 200;

fn main() -> Result<(), seamwise::attr::Error> {
    let corners = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| [x, y]));
    let uvs: Vec<[f32; 2]> = corners.map(|xy| xy.map(|at| at as f32 / SIDE as f32)).collect();
    let place = |&[u, v]: &[f32; 2]| [u, v, 0.05 * (9.0 * u).sin() * (1.0 - v)];
    let positions: Vec<[f32; 3]> = uvs.iter().map(place).collect();
    let squares = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| y * (SIDE + 1) + x));
    let indices: Vec<u32> =
        squares.flat_map(|a| [a, a + 1, a + SIDE + 2, a, a + SIDE + 2, a + SIDE + 1]).collect();

    let cloth = Vertices::new(&positions, &indices)?.with_uvs(&uvs)?;
    let pinned: Vec<bool> = uvs.iter().map(|uv| matches!(uv, [0.0 | 1.0, 1.0])).collect();
    for level in Simplifier::new(&cloth).locked(&pinned).run(&[0.1, 0.01, 0.001])? {
        let (triangles, vertices) = (level.vertices.triangles.len(), level.sources.len());
        println!("{triangles} triangles over {vertices} vertices, error {:.5}", level.error);
    }
    Ok(())
}
