import numpy as np
import pytest

import seamwise

UVS = np.float32([[0, 0], [0.5, 0], [0.5, 1], [0, 1]])
TRIANGLES = np.uint32([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(
    ("dtype", "channels"), [(np.uint8, 1), (np.uint8, 3), (np.uint8, 4), (np.uint16, 4), (np.float32, 3)]
)
def test_the_half_that_no_chart_covers_is_filled_and_the_other_is_left(dtype, channels):
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    image = np.zeros((16, 16, channels), dtype)
    image[:, :8] = np.array([0.75, 0.5, 0.25, 1.0][:channels]) * top
    image[:, 8:] = top
    done = seamwise.repair(image, UVS, TRIANGLES, wrap="clamp")
    assert done.filled == 128 and done.remaining == 0 and done.image.dtype == dtype
    assert np.array_equal(done.valid, np.arange(16) < np.full((16, 1), 8))
    assert np.array_equal(done.image[:, :8], image[:, :8])
    assert np.allclose(done.image[:, 8:], image[0, 0], atol=top / 200)


def test_a_mask_tells_too_and_so_does_a_background():
    image = np.full((64, 64, 3), [255, 0, 255], np.uint8)
    image[16:48, 16:48] = [20, 60, 200]
    mask = (image == [20, 60, 200]).all(axis=2)
    by_mask = seamwise.repair(image, mask=mask)
    assert np.array_equal(by_mask.valid, mask) and (by_mask.image == [20, 60, 200]).all()
    by_background = seamwise.repair(image)
    assert np.array_equal(by_background.image, by_mask.image)


def test_a_gray_image_keeps_its_shape():
    image = np.zeros((8, 8), np.uint8)
    image[:, :4] = 90
    done = seamwise.repair(image, UVS, TRIANGLES)
    assert done.image.shape == (8, 8) and (done.image == 90).all()


def test_what_does_not_fit_is_refused():
    image = np.zeros((8, 8, 3), np.uint8)
    with pytest.raises(seamwise.InvalidError, match="float64"):
        seamwise.repair(image.astype(float), UVS, TRIANGLES)
    with pytest.raises(seamwise.OptionsError, match="vertex 9 of 4"):
        seamwise.repair(image, UVS, [[0, 1, 9]])
    with pytest.raises(seamwise.OptionsError, match="UVs and triangles"):
        seamwise.repair(image, UVS)
    with pytest.raises(seamwise.OptionsError, match="a mask of 4×8"):
        seamwise.repair(image, mask=np.ones((4, 8), bool))
    with pytest.raises(seamwise.OptionsError, match="no role"):
        seamwise.repair(image, UVS, TRIANGLES, role="height")


def test_a_file_is_repaired_as_by_the_command(sample, tmp_path):
    report = seamwise.repair_file(sample, tmp_path / "whole.glb")
    assert (tmp_path / "whole.glb").stat().st_size > 1000
    assert report["images"][0]["filled"] > 0
