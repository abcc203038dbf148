//! The pictures of the method, and the baselines that it is compared with.

use std::path::Path;

use glam::DVec3;
use seamwise::inspect::quadrics::Quadrics;
use seamwise::limit::MemoryLimit;
use seamwise_attr::Isosurface;
use serde_json::Value;

use crate::cli::Stage;
use crate::common::build::Build;
use crate::common::shapes;

/// A closed beast of 5,804 triangles as an OFF: a body with head, horns and four legs, pulled out of a sphere of
/// 50 by 59 whose first two triangles are cut into three.
pub(crate) fn beast() -> String {
    let (segments, rings) = (50u32, 59u32);
    let limbs = [
        (DVec3::new(0.75, -0.6, 0.35), 1.0),
        (DVec3::new(0.75, -0.6, -0.35), 1.0),
        (DVec3::new(-0.75, -0.6, 0.35), 1.0),
        (DVec3::new(-0.75, -0.6, -0.35), 1.0),
        (DVec3::new(1.0, 0.45, 0.0), 0.9),
        (DVec3::new(0.8, 0.75, 0.35), 0.5),
        (DVec3::new(0.8, 0.75, -0.35), 0.5),
    ];
    let place = |direction: DVec3| {
        let out = limbs.iter().map(|(limb, length)| {
            let near = direction.dot(limb.normalize()).max(0.0).powi(48);
            limb.normalize() * (length * near)
        });
        direction * DVec3::new(1.5, 0.9, 0.7) + out.sum::<DVec3>()
    };
    let mut points = vec![DVec3::Y];
    for ring in 1..rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for segment in 0..segments {
            let around = std::f64::consts::TAU * f64::from(segment) / f64::from(segments);
            let (sin, cos) = polar.sin_cos();
            points.push(DVec3::new(sin * around.cos(), cos, sin * around.sin()));
        }
    }
    points.push(DVec3::NEG_Y);
    let at = |ring: u32, segment: u32| 1 + (ring - 1) * segments + segment % segments;
    let last = points.len() as u32 - 1;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for segment in 0..segments {
        triangles.push([0, at(1, segment + 1), at(1, segment)]);
        triangles.push([last, at(rings - 1, segment), at(rings - 1, segment + 1)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    for own in 0..2 {
        let [a, b, c] = triangles[own];
        let sum: DVec3 = [a, b, c].iter().map(|&at| points[at as usize]).sum();
        points.push(sum.normalize());
        let middle = points.len() as u32 - 1;
        triangles[own] = [a, b, middle];
        triangles.extend([[b, c, middle], [c, a, middle]]);
    }
    assert_eq!(triangles.len(), 5804);
    let mut text = format!("OFF\n{} {} 0\n", points.len(), triangles.len());
    for p in points.into_iter().map(place) {
        text += &format!("{:.6} {:.6} {:.6}\n", p.x, p.y, p.z);
    }
    for [a, b, c] in triangles {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

#[test]
fn baselines_reach_the_counts_of_a_beast_and_one_command_draws_their_rows() {
    let stage = Stage::new();
    stage.put("beast.off", beast().as_bytes());
    let mut files = vec!["beast.off".to_owned()];
    let mut distances = Vec::new();
    for cost in ["classic", "midpoint", "decimation"] {
        let baked = stage.run(&[
            "bake",
            "beast.off",
            "-o",
            cost,
            "--cost",
            cost,
            "--triangles",
            "3000,1000,250",
        ]);
        assert_eq!(baked.code, 0, "{}", baked.stderr);
        let report = read_json(&stage.path(cost).join("beast.json"));
        for (level, most) in report["levels"].as_array().unwrap().iter().zip([3000, 1000, 250]) {
            let count = level["triangles"].as_u64().unwrap();
            assert!(count <= most && count >= most - 2, "{cost}: {count} of {most}");
            distances.push(level["metrics"]["distance_rms"].as_f64().unwrap());
        }
        assert_eq!(report["seconds"]["polish"].as_f64().map(|own| own < 0.5), Some(true));
        files.extend((1..=3).map(|level| format!("{cost}/beast_lod{level}.glb")));
    }
    println!("distances: {distances:?}");
    for level in 0..3 {
        let (classic, midpoint) = (distances[level], distances[3 + level]);
        assert!(classic < 0.8 * midpoint, "{classic} {midpoint}");
    }
    let mut arguments = vec!["evaluate"];
    arguments.extend(files.iter().map(String::as_str));
    let camera = "4,2,5,0,0,0,42";
    arguments.extend(["--sheet", "rows.png", "--sheet-rows", "series", "--wireframe"]);
    arguments.extend([
        "--camera",
        camera,
        "--views",
        "2",
        "--resolution",
        "128",
        "--samples",
        "1000",
    ]);
    let drawn = stage.run(&arguments);
    assert_eq!(drawn.code, 0, "{}", drawn.stderr);
    let sheet = image::open(stage.path("rows.png")).expect("a picture");
    // Three rows of the reference and three levels each.
    assert!(sheet.width() > sheet.height() * 5 / 4, "{} × {}", sheet.width(), sheet.height());
    if let Some(folder) = std::env::var_os("SEAMWISE_PICTURES") {
        std::fs::copy(stage.path("rows.png"), Path::new(&folder).join("beast.png")).unwrap();
    }
}

#[test]
fn every_ellipsoid_of_a_model_has_epsilon_on_it_and_the_rest_is_counted() {
    let mut build = Build::of(&shapes::torus(24, 12));
    // Turned, moved and scaled unevenly: quadrics go along.
    let node = &mut build.json["nodes"][0];
    node["scale"] = serde_json::json!([2.0, 1.0, 0.5]);
    node["rotation"] = serde_json::json!([0.0, 0.6, 0.0, 0.8]);
    node["translation"] = serde_json::json!([100.0, -3.0, 2.0]);
    let asset = seamwise::import::read_bytes(&build.glb(), Path::new("")).unwrap();
    for (level, epsilon) in [(0, None), (2, None), (2, Some(1.0))] {
        let own = Quadrics::of(&asset, level, epsilon, MemoryLimit::default()).unwrap();
        assert!(!own.solids.is_empty());
        let counts = own.census;
        assert_eq!(counts.points, counts.drawn + counts.open + counts.empty + counts.wide);
        assert_eq!(counts.drawn, own.solids.len());
        for solid in &own.solids {
            for turn in 0..20 {
                let (sin, cos) = (1.3 * f64::from(turn)).sin_cos();
                let height = f64::from(turn) / 10.0 - 0.95;
                let round = (1.0 - height * height).sqrt();
                let p = solid.ellipsoid.point(DVec3::new(cos * round, sin * round, height));
                let value = solid.quadric.evaluate(p);
                assert!((value - own.epsilon).abs() < 1e-6 * own.epsilon, "{value}");
            }
            let again = solid.quadric.isosurface(solid.value);
            assert!(matches!(again, Isosurface::Ellipsoid(_)));
        }
    }
    let flat = seamwise::import::read_bytes(&Build::of(&seam_cube()).glb(), Path::new("")).unwrap();
    let own = Quadrics::of(&flat, 0, None, MemoryLimit::default()).unwrap();
    assert_eq!((own.census.drawn, own.census.points), (8, own.census.open + 8), "its corners");
    assert!(own.solids.iter().all(|own| own.ellipsoid.thickness() > 0.4));
}

fn seam_cube() -> shapes::Shape {
    shapes::seam_cube(4)
}

#[test]
fn quadrics_are_drawn_as_a_picture_and_as_a_model_that_is_read_again() {
    let stage = Stage::new();
    stage.put("torus.glb", &Build::of(&shapes::torus(24, 12)).glb());
    let ran = stage.run(&["quadrics", "torus.glb", "--level", "1", "-o", "out.glb"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stdout.contains("288 triangles, 144 points"), "{}", ran.stdout);
    let told = stage.run(&["inspect", "out.glb"]);
    assert_eq!(told.code, 0, "{}", told.stderr);
    let ran = stage.run(&["quadrics", "torus.glb", "-o", "out.png", "--resolution", "96"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(image::open(stage.path("out.png")).unwrap().width(), 96);
    let wrong = stage.run(&["quadrics", "torus.glb", "-o", "out.obj"]);
    assert!(wrong.code == 2 && wrong.stderr.contains(".png"), "{}", wrong.stderr);
    let wrong = stage.run(&["quadrics", "torus.glb", "-o", "out.png", "--epsilon", "0"]);
    assert!(wrong.code == 2 && wrong.stderr.contains("epsilon"), "{}", wrong.stderr);
}

#[test]
fn smooth_normals_are_made_on_request_and_the_bake_keeps_them() {
    let stage = Stage::new();
    stage.put("beast.off", beast().as_bytes());
    let mut sizes = Vec::new();
    for (folder, arguments) in [("flat", &[][..]), ("smooth", &["--smooth-normals"])] {
        let bake = ["bake", "beast.off", "-o", folder, "--ratios", "0.1", "--no-evaluate"];
        let ran = stage.run(&[&bake[..], arguments].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let bytes = std::fs::read(stage.path(folder).join("beast_lod1.glb")).unwrap();
        let has_normals = bytes.windows(8).any(|own| own == b"\"NORMAL\"");
        assert_eq!(has_normals, folder == "smooth");
        sizes.push(bytes.len());
    }
    assert!(sizes[1] < 3 * sizes[0], "nothing of the source is left in it: {sizes:?}");
}

#[test]
fn the_levels_of_a_fill_are_drawn_beside_its_result() {
    let stage = Stage::new();
    let picture = image::RgbImage::from_fn(64, 32, |x, y| match x < 20 && y > 4 {
        true => image::Rgb([200, (3 * x) as u8, (5 * y) as u8]),
        false => image::Rgb([255, 0, 255]),
    });
    picture.save(stage.path("atlas.png")).unwrap();
    let repair = ["repair", "atlas.png", "-o", "out.png", "--background", "#ff00ff"];
    let ran = stage.run(&[&repair[..], &["--pyramid", "levels.png"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let levels = image::open(stage.path("levels.png")).unwrap();
    assert_eq!(
        (levels.width(), levels.height()),
        (4 * 260 + 4, 7 * 274 + 4),
        "from 64 texels to one"
    );
    let ran = stage.run(&[&repair[..], &["--pyramid", "levels"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(std::fs::read_dir(stage.path("levels")).unwrap().count(), 7 * 4);
    let picture = |name: &str| image::open(stage.path("levels").join(name)).unwrap().to_rgb8();
    let (filled, result) = (picture("0_push.png"), image::open(stage.path("out.png")).unwrap());
    assert_eq!((filled.dimensions(), picture("6_push.png").dimensions()), ((64, 32), (1, 1)));
    let result = result.to_rgb8();
    for (x, y, own) in filled.enumerate_pixels() {
        let is_kept = x < 20 && y > 4;
        let same = own.0.iter().zip(result.get_pixel(x, y).0).all(|(a, b)| a.abs_diff(b) <= 1);
        assert!(if is_kept { same } else { own.0[2] < 200 }, "{x}, {y}: {own:?}");
    }
    let wrong = stage.run(&[&repair[..], &["--pyramid", "levels.jpg"]].concat());
    assert!(wrong.code == 2 && wrong.stderr.contains(".png"), "{}", wrong.stderr);
}

#[test]
fn reports_of_several_bakes_are_one_page_and_a_batch_writes_it() {
    let stage = Stage::new();
    for name in ["a", "b"] {
        stage.put(&format!("{name}.glb"), &Build::of(&shapes::torus(16, 8)).glb());
    }
    let ran = stage.run(&["bake", "a.glb", "b.glb", "-o", "out", "--levels", "2", "--report"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let page = std::fs::read_to_string(stage.path("out/models.html")).expect("a page");
    assert!(page.contains("href=\"a.html\"") && page.contains("href=\"b.html\""));
    let ran = stage.run(&["report", "out/a.json", "out/b.json", "-o", "page.html"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let page = std::fs::read_to_string(stage.path("page.html")).expect("a page");
    assert!(page.contains("href=\"out/a.html\"") && page.matches("<tr>").count() == 5);
    let wrong = stage.run(&["report", "a.glb", "-o", "page.html"]);
    assert!(wrong.code == 2 && wrong.stderr.contains("a.glb"), "{}", wrong.stderr);
}
