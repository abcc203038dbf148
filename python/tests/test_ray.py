import os
import signal
import subprocess
import threading
import time

import numpy as np
import pytest

import seamwise

ray = pytest.importorskip("ray")
trimesh = pytest.importorskip("trimesh")
pandas = pytest.importorskip("pandas")

import seamwise.ray  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


@pytest.fixture
def assets(tmp_path):
    """40 files, three of which are broken."""
    paths = []
    for at in range(40):
        path = tmp_path / f"rock_{at:02}.glb"
        rock = trimesh.creation.icosphere(4)
        rock.vertices *= 1 + 0.1 * np.sin(at + 5 * rock.vertices[:, [0]])
        path.write_bytes(rock.export(file_type="glb") if at % 15 != 7 else b"glTF and no more")
        paths.append(path)
    return paths


def _kill_a_worker(seen):
    """Kills the first worker that bakes, with no chance to tell anybody."""
    for _ in range(600):
        found = subprocess.run(["pgrep", "-f", "ray::.*Map"], capture_output=True, text=True).stdout.split()
        if found:
            time.sleep(1.0)
            os.kill(int(found[0]), signal.SIGKILL)
            seen.append(found[0])
            return
        time.sleep(0.1)


def test_nothing_is_lost_when_a_worker_dies_and_failures_are_rows(assets, tmp_path):
    seen = []
    killer = threading.Thread(target=_kill_a_worker, args=(seen,))
    killer.start()
    options = {"ratios": [0.25], "views": 1, "resolution": 32, "samples": 500}
    table = seamwise.ray.bake(assets, tmp_path / "out", reports=tmp_path / "reports", **options)
    killer.join()
    assert seen, "no worker was there to be killed"
    assert list(table.path) == [str(path) for path in assets]
    failed = table[table.status == "failed"]
    assert list(failed.name) == ["rock_07", "rock_22", "rock_37"]
    assert failed.error.str.contains("rock_").all() and failed.report.isna().all()
    done = table[table.status != "failed"]
    assert len(done) == 37 and (done.triangles == 5120).all()
    assert all((tmp_path / "out" / f"{name}_lod1.glb").exists() for name in done.name)
    stored = pandas.read_parquet(tmp_path / "reports").sort_values("path", ignore_index=True)
    assert list(stored.status) == list(table.status)

    again = seamwise.ray.bake(assets, tmp_path / "out", **options)
    assert (again.status.value_counts().to_dict()) == {"skipped": 37, "failed": 3}


def test_two_of_one_name_are_refused(tmp_path):
    with pytest.raises(seamwise.OptionsError, match="both write"):
        seamwise.ray.bake(["a/x.glb", "b/x.glb", "c/x.glb"], tmp_path)
