import os
import threading
import time

import numpy as np
import pytest

import seamwise


def test_levels_come_in_their_order_with_the_arrays_of_the_source(hill):
    positions, triangles, uvs = hill
    groups = np.repeat(np.arange(2, dtype=np.uint32), len(triangles) // 2)
    colors = np.ones((len(positions), 4), np.float32)
    few, many = seamwise.simplify(
        positions, triangles, [0.1, 1000], uvs=uvs, normals=_up(positions), colors=colors, groups=groups
    )
    assert 150 < len(few.triangles) <= 205 and 990 < len(many.triangles) <= 1000
    for level in (few, many):
        count = len(level.positions)
        assert level.positions.shape == (count, 3) and level.positions.dtype == np.float32
        assert level.triangles.dtype == np.uint32 and level.triangles.max() == count - 1
        assert level.uvs[0].shape == (count, 2) and level.colors.shape == (count, 4)
        assert np.allclose(np.linalg.norm(level.normals, axis=1), 1, atol=1e-5)
        assert level.groups.shape == (len(level.triangles),) and set(level.groups) == {0, 1}
        assert level.sources.shape == (count,) and level.stopped is None
        # The plan is the UVs, of the level as of the source.
        assert np.abs(level.uvs[0] - level.positions[:, :2]).max() < 0.02


def test_ends_are_vertices_of_the_source_and_locks_stay_to_the_bit(hill):
    positions, triangles, uvs = hill
    (level,) = seamwise.simplify(positions, triangles, [0.2], uvs=uvs, placement="ends")
    assert np.array_equal(level.positions, positions[level.sources])
    locked = positions[:, 0] == 0.5
    (level,) = seamwise.simplify(positions, triangles, [0.05], locked=locked)
    kept = {tuple(p) for p in level.positions}
    assert all(tuple(p) in kept for p in positions[locked])


def test_the_input_is_not_changed_and_other_types_are_converted(hill):
    positions, triangles, _ = hill
    before = positions.copy()
    one = seamwise.simplify(positions, triangles, [0.3])[0]
    two = seamwise.simplify(positions.astype(float).tolist(), triangles.astype(np.int64), [0.3])[0]
    assert np.array_equal(positions, before)
    assert np.array_equal(one.positions, two.positions)
    assert np.array_equal(one.triangles, two.triangles)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"uvs": np.zeros((3, 2))}, seamwise.InvalidError, "3 UVs for 1089 vertices"),
        ({"uvs": np.zeros((1089, 3))}, seamwise.OptionsError, r"uvs are of shape \(n, 2\)"),
        ({"triangles": [[0, 1, 5000]]}, seamwise.InvalidError, "past the end"),
        ({"triangles": [[0, 1, -1]]}, seamwise.InvalidError, "triangles lie in 0"),
        ({"triangles": [[0.0, 1.0, 2.0]]}, seamwise.InvalidError, "integers"),
        ({"positions": [0.0, 1.0]}, seamwise.InvalidError, "positions are of shape"),
        ({"targets": [1.5]}, seamwise.OptionsError, "is no size"),
        ({"cost": "cheap"}, seamwise.OptionsError, "is no cost"),
        ({"weights": {"shine": 1.0}}, seamwise.OptionsError, "has no weight"),
        ({"locked": np.zeros(2, bool)}, seamwise.OptionsError, "2 locks for 1089"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_name(hill, change, error, message):
    positions, triangles, _ = hill
    arguments = {"positions": positions, "triangles": triangles, "targets": [0.5], **change}
    with pytest.raises(error, match=message):
        seamwise.simplify(**arguments)
    assert issubclass(error, ValueError)


@pytest.mark.skipif(not os.path.exists("/proc/self/clear_refs"), reason="only Linux tells the peak since then")
def test_a_million_triangles_are_copied_once_on_their_way_in():
    positions, triangles = _field(708)
    assert len(triangles) > 990_000
    uvs = np.ascontiguousarray(positions[:, :2])
    taken = sum(own.nbytes for own in (positions, triangles, uvs))
    before = _memory("VmRSS")
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    # What is refused after the arrays have come in costs nothing else.
    with pytest.raises(seamwise.OptionsError, match="no cost"):
        seamwise.simplify(positions, triangles, [0.5], uvs=uvs, cost="cheap")
    assert _memory("VmHWM") - before < 1.25 * taken + 2e6


def test_other_threads_run_meanwhile():
    positions, triangles = _field(300)
    work = threading.Thread(target=seamwise.simplify, args=(positions, triangles, [0.1]))
    work.start()
    ticks = 0
    while work.is_alive():
        ticks += 1
        time.sleep(0.001)
    assert ticks > 20


def _field(n):
    """Waves over n × n points."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    positions = np.stack([x, y, 0.1 * np.sin(20 * x * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, n + 1], corner + [0, n + 1, n]]).astype(np.uint32)
    return positions, triangles


def _memory(name):
    """Bytes of memory of this process."""
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(name))


def _up(positions):
    return np.tile(np.float32([0, 0, 1]), (len(positions), 1))
