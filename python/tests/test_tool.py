"""What the package does is what the tool does, to the bit."""

import json
import os
import subprocess
from pathlib import Path

import pytest

import seamwise

TOOL = Path(os.environ.get("SEAMWISE_TOOL", Path(__file__).parents[2] / "target/debug/seamwise"))
FAST = {"views": 2, "resolution": 64, "samples": 2000}
FAST_OPTIONS = [word for name, value in FAST.items() for word in (f"--{name}", str(value))]

pytestmark = pytest.mark.skipif(not TOOL.exists(), reason=f"{TOOL} is absent")


def _run(*arguments):
    subprocess.run([TOOL, "--quiet", *map(str, arguments)], check=True)


def test_files_of_a_bake_are_the_tools(sample, tmp_path):
    baked = seamwise.bake(sample, ratios=[0.25], evaluate=False, layout="msft_lod")
    options = ["--ratios", "0.25", "--no-evaluate", "--layout", "msft_lod"]
    _run("bake", sample, "-o", tmp_path, *options)
    told = {path.name: path.read_bytes() for path in tmp_path.glob("*.glb")}
    assert sorted(baked.files) == sorted(told)
    # Told by name alone: a difference of megabytes takes minutes to print.
    assert [name for name in told if baked.files[name] != told[name]] == []


def test_figures_are_the_tools(sample, tmp_path):
    level = tmp_path / "level.glb"
    level.write_bytes(seamwise.bake(sample, ratios=[0.1], evaluate=False).files["sample_lod1.glb"])
    (figures,) = seamwise.evaluate(sample, level, **FAST)
    _run("evaluate", sample, level, *FAST_OPTIONS, "--json", tmp_path / "told.json")
    (told,) = json.loads((tmp_path / "told.json").read_bytes())["candidates"]
    assert figures == told["metrics"]


def test_a_repaired_file_is_the_tools(sample, tmp_path):
    seamwise.repair_file(sample, tmp_path / "one.glb")
    _run("repair", sample, "-o", tmp_path / "two.glb")
    assert (tmp_path / "one.glb").read_bytes() == (tmp_path / "two.glb").read_bytes()
