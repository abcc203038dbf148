use std::sync::atomic::AtomicUsize;

use super::*;
use crate::chain::{polish_chain, simplify_chain};
use crate::options::Options;
use crate::polish::Polish;
use crate::testing::surface;

fn wave(x: f32, y: f32) -> f32 {
    0.08 * (11.0 * x).sin() * (9.0 * y + 1.0).cos()
}

fn levels(source: &Mesh, triangles: usize) -> Vec<Level> {
    let (options, done) = (Options::default(), AtomicUsize::new(0));
    let mut levels = simplify_chain(source, &[triangles], &options, &done).unwrap();
    polish_chain(source, &mut levels, &options, &Polish::default(), &done).unwrap();
    levels
}

/// The share of places of a badge that lie below the wall.
fn sunk(wall: &Mesh, badge: &Mesh, world: &DMat4) -> f64 {
    let up = |mesh: &Mesh, world: &DMat4| {
        let place = |p: &Vec3| world.transform_point3(p.as_dvec3()).as_vec3();
        let positions: Vec<Vec3> = mesh.positions.iter().map(place).collect();
        let triangles = (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0));
        Surface::new(&positions, triangles)
    };
    let (wall, badge) = (up(wall, &DMat4::IDENTITY), up(badge, world));
    let (mut below, mut all) = (0, 0);
    for i in 0..60u8 {
        for j in 0..60u8 {
            let at = |k: u8| 0.35 + 0.3 * (f32::from(k) + 0.5) / 60.0;
            let ray = |s: &Surface| s.first_hit(Vec3::new(at(i), at(j), 9.0), -Vec3::Z, 18.0);
            if let (Some(wall), Some(badge)) = (ray(&wall), ray(&badge)) {
                below += usize::from(wall.distance < badge.distance);
                all += 1;
            }
        }
    }
    assert!(all > 3000, "{all}");
    f64::from(below as u32) / f64::from(all as u32)
}

#[test]
fn a_badge_on_a_wall_stays_on_it_wherever_its_node_is() {
    let wall = surface(48, |x, y| Vec3::new(x, y, wave(x, y)));
    let world = DMat4::from_scale_rotation_translation(
        DVec3::splat(0.5),
        glam::DQuat::from_rotation_z(0.4),
        DVec3::new(0.1, -0.3, 0.2),
    );
    let back = world.inverse();
    let badge = surface(16, |x, y| {
        let [x, y] = [x, y].map(|at| 0.3 + 0.4 * at);
        let p = DVec3::new(f64::from(x), f64::from(y), f64::from(wave(x, y) + 0.001));
        back.transform_point3(p).as_vec3()
    });
    let (mut walls, mut badges) = (levels(&wall, 280), levels(&badge, 40));
    let before = sunk(&walls[0].mesh, &badges[0].mesh, &world);
    let mut surfaces = [
        Layered { source: &wall, levels: &mut walls, world: DMat4::IDENTITY, locked: &[] },
        Layered { source: &badge, levels: &mut badges, world, locked: &[] },
    ];
    keep_fronts(&mut surfaces);
    let after = sunk(&walls[0].mesh, &badges[0].mesh, &world);
    assert!(before > 0.05 && after < 0.02, "{after} after {before}");
}

#[test]
fn a_shell_alone_and_what_is_locked_stay() {
    let wall = surface(24, |x, y| Vec3::new(x, y, wave(x, y)));
    let mut own = levels(&wall, 100);
    let before = own[0].mesh.clone();
    let world = DMat4::IDENTITY;
    keep_fronts(&mut [Layered { source: &wall, levels: &mut own, world, locked: &[] }]);
    assert_eq!(own[0].mesh, before);
    let above = surface(24, |x, y| Vec3::new(x, y, wave(x, y) + 0.001));
    let (mut low, mut high) = (levels(&wall, 200), levels(&above, 60));
    let before = [low[0].mesh.clone(), high[0].mesh.clone()];
    let locked = vec![true; above.positions.len()];
    keep_fronts(&mut [
        Layered { source: &wall, levels: &mut low, world, locked: &[] },
        Layered { source: &above, levels: &mut high, world, locked: &locked },
    ]);
    assert_eq!([low[0].mesh.clone(), high[0].mesh.clone()], before);
}
