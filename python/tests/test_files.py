import json
import threading

import pytest

import seamwise

FAST = {"views": 2, "resolution": 64, "samples": 2000}


def test_a_folder_gets_the_bytes_that_memory_gets(sample, tmp_path):
    baked = seamwise.bake(sample, ratios=[0.5, 0.1], layout="msft_lod", **FAST)
    assert list(baked.files) == ["sample_lod1.glb", "sample_lod2.glb", "sample.glb"]
    written = seamwise.bake(str(sample), tmp_path, ratios=[0.5, 0.1], layout="msft_lod", **FAST)
    assert written.files == {}
    for name, data in baked.files.items():
        assert (tmp_path / name).read_bytes() == data
    report = json.loads((tmp_path / "sample.json").read_text())
    assert report["levels"] == written.report["levels"]
    assert [level["ratio"] for level in report["levels"]] == [0.5, 0.1]


def test_what_is_done_is_left_alone_until_something_changes(sample, tmp_path):
    source = tmp_path / "ewer.glb"
    source.write_bytes(sample.read_bytes())
    out = tmp_path / "out"
    options = {"ratios": [0.1], "evaluate": False, "resume": True}
    first = seamwise.bake(source, out, **options)
    again = seamwise.bake(source, out, **options)
    assert not first.skipped and again.skipped and again.report == first.report
    assert not seamwise.bake(source, out, **{**options, "ratios": [0.2]}).skipped
    (out / "ewer_lod1.glb").unlink()
    assert not seamwise.bake(source, out, **{**options, "ratios": [0.2]}).skipped


def test_bytes_are_baked_as_their_file_is(sample):
    options = {"ratios": [0.2], "evaluate": False}
    one = seamwise.bake(sample, **options)
    two = seamwise.bake(sample.read_bytes(), name="sample", **options)
    assert one.files == two.files and one.report["levels"][0]["metrics"] is None


def test_levels_are_measured_and_a_thing_is_as_far_from_itself_as_it_should_be(sample):
    level = seamwise.bake(sample, ratios=[0.1], evaluate=False).files["sample_lod1.glb"]
    same, coarse = seamwise.evaluate(sample, [sample, level], **FAST)
    assert same["distance_max"] == 0 and same["silhouette_iou"] == 1
    assert 0 < coarse["distance_rms"] < 0.02 and coarse["rms_luminance"] > 0
    (alone,) = seamwise.evaluate(sample, level, **FAST)
    assert alone == coarse


def test_inspect_counts_triangles(sample):
    found = seamwise.inspect(sample)
    assert found["total"]["triangles"] > 1000


def test_a_list_names_inputs_and_parts_of_it_add_up(tmp_path):
    path = tmp_path / "list.txt"
    path.write_text("# ships\nb.glb\n\n a b.glb\r\nc.obj\n")
    assert [str(own) for own in seamwise.manifest(path)] == ["b.glb", "a b.glb", "c.obj"]
    parts = [seamwise.manifest(path, f"{part}/2") for part in (1, 2)]
    assert sorted(parts[0] + parts[1]) == sorted(seamwise.manifest(path))
    assert [str(own) for own in parts[1]] == ["b.glb"]
    with pytest.raises(seamwise.OptionsError, match="3/2"):
        seamwise.manifest(path, "3/2")
    with pytest.raises(seamwise.FileError) as caught:
        seamwise.manifest(tmp_path / "none.txt")
    assert caught.value.path == str(tmp_path / "none.txt")


def test_errors_carry_the_file_and_the_place_in_it(tmp_path):
    missing = tmp_path / "missing.glb"
    with pytest.raises(seamwise.FileError) as caught:
        seamwise.inspect(missing)
    assert isinstance(caught.value, OSError) and caught.value.path == str(missing)
    wrong = tmp_path / "wrong.gltf"
    wrong.write_text('{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}')
    with pytest.raises(seamwise.InvalidError) as caught:
        seamwise.bake(wrong)
    assert caught.value.path == str(wrong)
    assert caught.value.place.startswith("/meshes/0/primitives/0"), caught.value.place
    assert str(wrong) in str(caught.value)


def test_options_that_make_no_sense_are_refused(sample):
    for options, message in [
        ({"ratios": [0.5], "triangles": [5]}, "not both"),
        ({"ratios": [0.1, 0.5]}, "fine to coarse"),
        ({"textures": "new"}, "auto, repair, transfer, keep"),
        ({"time_limit": -1.0}, "time limit"),
    ]:
        with pytest.raises(seamwise.OptionsError, match=message):
            seamwise.bake(sample, **options)


def test_progress_is_told_and_an_exception_in_it_ends_the_bake(sample, tmp_path):
    told = []
    seamwise.bake(sample, tmp_path, ratios=[0.1], **FAST, progress=lambda *step: told.append(step))
    stages = [stage for stage, _, _ in told]
    assert stages.index("simplify") < stages.index("evaluate")
    assert all(done == total for stage, done, total in told[-1:])

    def stop(stage, done, total):
        if stage == "polish":
            raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        seamwise.bake(sample, tmp_path / "none", progress=stop)
    assert not (tmp_path / "none").exists()


def test_an_interrupt_ends_a_bake_between_stages(sample):
    import _thread
    import signal

    # What a shell starts in the background ignores interrupts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt(stage, done, total):
        if stage == "simplify" and done == 0:
            _thread.interrupt_main()

    assert threading.current_thread() is threading.main_thread()
    with pytest.raises(KeyboardInterrupt):
        seamwise.bake(sample, progress=interrupt)
    signal.signal(signal.SIGINT, before)


def test_errors_survive_a_process_boundary():
    import pickle

    for error in [seamwise.FileError("a: no", "a"), seamwise.InvalidError("b", "f", "/meshes/0")]:
        again = pickle.loads(pickle.dumps(error))
        assert (type(again), str(again), again.path, again.place) == (
            type(error),
            str(error),
            error.path,
            error.place,
        )


def test_textures_are_written_for_graphics_processors_and_say_what_they_take_there(sample):
    options = {"ratios": [0.1], "evaluate": False, "polish": False}
    plain = seamwise.bake(sample, **options).report["levels"][0]
    packed = seamwise.bake(sample, texture_format="ktx2", **options).report["levels"][0]
    assert {own["format"] for own in packed["textures"]} == {"image/ktx2"}
    assert plain["texture_gpu_bytes"] > 3.9 * packed["texture_gpu_bytes"]
    with pytest.raises(seamwise.OptionsError, match="transfer"):
        seamwise.bake(sample, textures="repair", texture_format="jpeg", **options)
