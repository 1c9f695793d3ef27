"""Files of a prediction: complete or absent, and no file of a simulation among them."""

import json
import os
import resource
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from braidcast import Case, Deployment, InputError, __version__, write_deployment
from braidcast.deployment import drawing, picture
from braidcast.surrogate.output import _caption, _scale_end, summary, write_prediction
from braidcast.surrogate.placed_braid import placed_braid
from braidcast.surrogate.prediction import Prediction

EXAMPLE = Path(__file__).parents[2] / "examples" / "success.toml"
FILES = {"deployed.vtp", "vessel.stl", "summary.json"}
PICTURES = {"deployed.png", "deployed_std.png"}
OUTSIDE = "vessel_diameter = 4.2 mm, trained from 2 to 4 mm"


@pytest.fixture(scope="module")
def prediction() -> Prediction:
    """The placed braid, less certain towards its ends."""
    case = Case.from_toml(EXAMPLE)
    positions = placed_braid(case).positions
    ring = np.array(case.braid.rings)
    std = (0.02 + 0.08 * np.abs(2.0 * ring / ring.max() - 1.0))[:, None] * [0.5, 1.0, 2.0]

    def sampler(n: int, rng: np.random.Generator) -> np.ndarray:
        return positions + std * rng.standard_normal((n, *std.shape))

    return Prediction(
        case=case,
        positions=positions,
        std=std,
        success_probability=0.98,
        threshold=0.5,
        in_range=True,
        out_of_range=(),
        nearest_case=123,
        nearest_distance=0.4,
        model="placed braid",
        wall_seconds=0.2,
        cpu_seconds=0.1,
        _sampler=sampler,
    )


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_its_quantities_are_those_of_a_deployment(prediction: Prediction) -> None:
    case, braid = prediction.case, prediction.case.braid
    centres = [prediction.positions[braid.rings == ring].mean(axis=0) for ring in (0, 1)]
    step = float(np.linalg.norm(centres[1] - centres[0]))
    assert prediction.deployed_length_mm == pytest.approx(step * braid.segments, rel=1e-2)
    assert prediction.free_length_mm == braid.length
    assert prediction.crimped_length_mm == case.crimped_length
    shortened = 1.0 - prediction.deployed_length_mm / case.crimped_length
    assert prediction.foreshortening_percent == pytest.approx(100.0 * shortened)
    depth = -case.vessel_geometry.distance(prediction.positions)
    np.testing.assert_allclose(prediction.wire_distance, depth - braid.wire_radius)
    np.testing.assert_allclose(prediction.std_norm, np.sqrt((prediction.std**2).sum(axis=1)))


def test_the_outcome_turns_at_the_threshold(prediction: Prediction) -> None:
    for probability, outcome in [(0.3, "success"), (0.29, "failure")]:
        given = replace(prediction, success_probability=probability, threshold=0.3)
        assert given.outcome == summary(given)["outcome"] == outcome


def test_samples_follow_their_seed(prediction: Prediction) -> None:
    drawn = prediction.sample(3, 1)
    assert drawn.shape == (3, *prediction.positions.shape)
    np.testing.assert_array_equal(drawn, prediction.sample(3, np.random.default_rng(1)))
    assert not np.array_equal(drawn, prediction.sample(3))


def test_files_are_read_back_as_they_were(prediction: Prediction, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    written = write_prediction(prediction, tmp_path / "out", picture=False)
    assert {path.name for path in written.files} == names(tmp_path / "out") == FILES
    assert written.notes == []
    read, made = pyvista.read(tmp_path / "out" / "deployed.vtp"), prediction.to_polydata()
    np.testing.assert_array_equal(read.points, prediction.positions)
    np.testing.assert_array_equal(read.lines, made.lines)
    assert set(read.point_data.keys()) == set(prediction.point_arrays)
    for name, values in prediction.point_arrays.items():
        np.testing.assert_array_equal(read.point_data[name], values)
        np.testing.assert_array_equal(made.point_data[name], values)
    assert pyvista.read(tmp_path / "out" / "vessel.stl").n_open_edges == 0


def test_the_summary_has_the_agreed_keys(prediction: Prediction, tmp_path: Path) -> None:
    given = replace(
        prediction, in_range=False, out_of_range=(OUTSIDE,), nearest_distance=float("nan")
    )
    write_prediction(given, tmp_path, picture=False)
    read = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert read == {
        "title": prediction.case.title,
        "outcome": "success",
        "success_probability": 0.98,
        "success_threshold": 0.5,
        "in_range": False,
        "out_of_range": [OUTSIDE],
        "nearest_case": 123,
        "nearest_distance": None,  # JSON has no NaN
        "std_mean_mm": pytest.approx(prediction.std_norm.mean()),
        "std_max_mm": pytest.approx(0.1 * np.sqrt(5.25)),
        "deployed_length_mm": prediction.deployed_length_mm,
        "free_length_mm": prediction.free_length_mm,
        "crimped_length_mm": prediction.crimped_length_mm,
        "foreshortening_percent": prediction.foreshortening_percent,
        "model": "placed braid",
        "wall_seconds": 0.2,
        "cpu_seconds": 0.1,
        "version": __version__,
    }


def test_either_kind_of_result_replaces_the_other(
    prediction: Prediction, deployment: Deployment, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("keep")
    write_deployment(deployment, tmp_path, frames=True, picture=False)
    (tmp_path / "deployed.png").write_bytes(b"of the simulation")
    write_prediction(prediction, tmp_path, picture=False)
    assert names(tmp_path) == FILES | {"notes.txt"}
    assert not (tmp_path / "frames").exists()
    for name in PICTURES:
        (tmp_path / name).write_bytes(b"of the prediction")
    write_deployment(deployment, tmp_path, picture=False)
    assert names(tmp_path) == FILES | {"notes.txt"}


def test_a_folder_in_the_way_of_a_picture_is_refused(
    prediction: Prediction, tmp_path: Path
) -> None:
    (tmp_path / "deployed_std.png").mkdir()
    with pytest.raises(InputError, match=r"has a folder called deployed_std\.png"):
        write_prediction(prediction, tmp_path, picture=False)


@pytest.mark.parametrize("room", [0, 50_000, 1_000_000])
def test_a_full_disk_leaves_nothing(prediction: Prediction, tmp_path: Path, room: int) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_prediction(prediction, tmp_path / "out", picture=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_that_cannot_be_moved_costs_only_itself(
    prediction: Prediction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    move = os.replace

    def refuse(source: Path, target: Path) -> None:
        if target.suffix == ".png":
            raise OSError(28, os.strerror(28))
        move(source, target)

    monkeypatch.setattr(picture.Drawer, "draw", lambda *_: [b"1", b"2"])
    monkeypatch.setattr(os, "replace", refuse)
    written = write_prediction(prediction, tmp_path)
    assert written.notes == ["no deployed.png and no deployed_std.png: No space left on device"]
    assert names(tmp_path) == FILES


def test_captions_say_what_not_to_trust(prediction: Prediction) -> None:
    assert _caption(prediction) == ("success predicted with probability 0.98",)
    for probability, says in [
        (0.996, "success predicted with probability more than 0.99"),
        (0.001, "failure predicted: probability of success less than 0.01"),
    ]:
        assert _caption(replace(prediction, success_probability=probability))[0] == says
    wrong = replace(
        prediction, success_probability=0.2, in_range=False, out_of_range=(OUTSIDE,) * 9
    )
    _, failure, outside = _caption(wrong)
    assert "do not trust" in failure
    assert outside.startswith(f"OUTSIDE THE TRAINING DATA: {OUTSIDE}; ")
    assert outside.endswith("...") and len(outside) <= 140


def test_the_scale_of_std_ends_at_a_round_number() -> None:
    for largest, end in [(0.0, 1e-3), (0.1, 0.1), (0.11, 0.2), (0.47, 0.5), (0.7, 0.8), (9.0, 10)]:
        assert _scale_end(np.full(100, largest)) == pytest.approx(end)


@pytest.mark.parametrize(("end", "decimals"), [(1.0, 1), (0.5, 1), (0.2, 2), (0.03, 3), (10, 0)])
def test_the_labels_of_a_scale_differ(end: float, decimals: int) -> None:
    assert drawing.decimals((0.0, end)) == decimals


def test_both_pictures_are_drawn(prediction: Prediction, tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    from PIL import Image

    written = write_prediction(prediction, tmp_path)
    if written.notes:
        assert "OpenGL" in written.notes[0]
        pytest.skip(written.notes[0])
    assert {path.name for path in written.files} == names(tmp_path) == FILES | PICTURES
    shown = []
    for name in sorted(PICTURES):
        with Image.open(tmp_path / name) as image:
            assert image.format == "PNG" and image.size == drawing.SIZE
            shown.append(np.asarray(image.convert("RGB"), dtype=int))
    differing = np.abs(shown[0] - shown[1]).sum(axis=-1) > 30
    assert 0.01 < differing.mean() < 0.6, "the same braid in other colours"
