import io

import numpy as np
import pytest

import seamwise
import seamwise.trimesh

trimesh = pytest.importorskip("trimesh")


def _load(path):
    return trimesh.load(path, force="mesh")


def test_a_textured_scan_is_simplified_repaired_and_measured(sample):
    scan = _load(sample)
    (quarter,) = seamwise.trimesh.simplify(scan, [0.25])
    assert 0.2 * len(scan.faces) < len(quarter.faces) <= 0.25 * len(scan.faces) + 1
    assert len(quarter.visual.uv) == len(quarter.vertices)
    whole = seamwise.trimesh.repair(quarter)
    before, after = (np.asarray(own.visual.material.baseColorTexture) for own in (quarter, whole))
    assert before.shape == after.shape and (before != after).any()
    (figures,) = seamwise.evaluate(
        scan.export(file_type="glb"), whole.export(file_type="glb"), views=2, resolution=64, samples=2000
    )
    assert figures["distance_rms"] < 0.02 and figures["color_rms"] < 0.1


def test_arrays_are_those_of_the_mesh(sample):
    scan = _load(sample)
    own = seamwise.trimesh.arrays(scan)
    direct = seamwise.simplify(targets=[0.25], **own)[0]
    (level,) = seamwise.trimesh.simplify(scan, [0.25])
    assert np.array_equal(level.vertices, direct.positions.astype(float))


def test_vertex_colors_come_along():
    sphere = trimesh.creation.icosphere(4)
    sphere.visual.vertex_colors = np.uint8([200, 100, 50, 255])
    (level,) = seamwise.trimesh.simplify(sphere, [0.2])
    assert (level.visual.vertex_colors == [200, 100, 50, 255]).all()


def test_a_mesh_without_texture_has_nothing_to_repair():
    with pytest.raises(seamwise.InvalidError, match="no texture"):
        seamwise.trimesh.repair(trimesh.creation.box())
