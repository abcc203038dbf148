//! `seamwise repair` on real lightmaps, full of fireflies and of what is no number.

use std::path::Path;

use assert_cmd::Command;
use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use seamwise::atlas::charts::Charts;
use seamwise::document::primitive::Primitive;
use seamwise_texture::{Validity, Wrap};

/// The lightmaps of a room and the names of the meshes that use them.
const LIGHTMAPS: [(&str, &str); 3] =
    [("Box", "cornell_box"), ("Large", "large_box"), ("Small", "small.box")];

/// Which texels the charts of UV set 1 cover, of the meshes of a name or whose nodes have it.
fn covered(file: &Path, name: &str, [width, height]: [usize; 2]) -> Validity {
    let asset = seamwise::import::read(file).expect("an asset");
    let of_name = |list: &str| {
        let objects = asset.json[list].as_array().expect("a list").iter().enumerate();
        objects.filter(|(_, object)| object["name"] == name).collect::<Vec<_>>()
    };
    let nodes = of_name("nodes");
    let used = nodes.iter().filter_map(|(_, node)| node["mesh"].as_u64()).map(|mesh| mesh as usize);
    let meshes = of_name("meshes").into_iter().map(|(mesh, _)| mesh).chain(used);
    let mut charts = Charts::default();
    for mesh in meshes {
        for primitive in Primitive::of_mesh(&asset, mesh).expect("primitives") {
            let own = Charts::read(&asset, &primitive, 1, glam::Affine2::IDENTITY);
            charts.append(own.expect("UVs").expect("UV set 1"));
        }
    }
    Validity::from_charts(width, height, [Wrap::Repeat; 2], &charts.uvs, &charts.triangles)
}

/// A file's channels of half floats.
fn channels(file: &Path) -> ([usize; 2], Vec<Vec<exr::prelude::f16>>) {
    let image = read_all_flat_layers_from_file(file).expect("an EXR");
    let layer = &image.layer_data[0];
    let halves = layer.channel_data.list.iter().map(|channel| match &channel.sample_data {
        FlatSamples::F16(samples) => samples.clone(),
        other => panic!("{other:?}"),
    });
    ([layer.size.0, layer.size.1], halves.collect())
}

#[test]
fn fireflies_around_the_charts_of_lightmaps_are_never_sources() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets/hdr/CornellBox"));
    if !folder.exists() {
        println!("skipped: {} is not there", folder.display());
        return;
    }
    let mesh = folder.join("CornellBox.glb");
    let scratch = tempfile::tempdir().expect("a folder");
    for (file, name) in LIGHTMAPS {
        let input = folder.join(format!("CornellBox-{file}.exr"));
        let output = scratch.path().join(format!("{file}.exr"));
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        command.arg("repair").arg(&input).arg("-o").arg(&output).arg("--mesh").arg(&mesh);
        command.args(["--uv-set", "1", "--mesh-name", name]).assert().success();
        let ((size, before), (_, after)) = (channels(&input), channels(&output));
        let charts = covered(&mesh, name, size);
        let finite = |texel: usize| before.iter().all(|channel| channel[texel].is_finite());
        let valid = |texel: usize| charts.flags()[texel] && finite(texel);
        let [mut most_valid, mut most_filled, mut most_outside] = [0.0f32; 3];
        let (mut filled, mut lost) = (0, 0);
        for texel in 0..size[0] * size[1] {
            lost += usize::from(!finite(texel));
            filled += usize::from(!valid(texel));
            for (before, after) in before.iter().zip(&after) {
                let (before, after) = (before[texel], after[texel]);
                assert!(after.is_finite(), "{file} {texel}");
                if valid(texel) {
                    assert_eq!(before.to_bits(), after.to_bits(), "{file} {texel}");
                    most_valid = most_valid.max(after.to_f32());
                } else {
                    most_filled = most_filled.max(after.to_f32());
                    let light = before.to_f32();
                    most_outside = most_outside.max(if light.is_finite() { light } else { 0.0 });
                }
            }
        }
        println!(
            "{file}: {size:?}, {lost} texels no numbers, {filled} filled; most light valid \
             {most_valid}, filled {most_filled}, outside before {most_outside}"
        );
        assert!(lost > 0 && filled > lost);
        assert!(most_filled <= most_valid, "{file}: {most_filled} {most_valid}");
    }
}
