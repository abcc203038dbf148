"""Meshes and files that the tests share."""

from pathlib import Path

import numpy as np
import pytest

SAMPLE = Path(__file__).parents[2] / "data" / "sample.glb"


@pytest.fixture
def sample():
    return SAMPLE


@pytest.fixture
def hill():
    """A hill over 32 × 32 squares: positions, triangles and its plan as UVs."""
    x, y = np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 33))
    z = 0.2 * np.sin(4 * x) * np.cos(3 * y)
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(32)[:, None] * 33 + np.arange(32)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, 34], corner + [0, 34, 33]]).astype(np.uint32)
    return positions, triangles, positions[:, :2].copy()
