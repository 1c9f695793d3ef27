"""Model files: the model that comes back is the one that went, and no other is taken."""

import io
import json
from pathlib import Path

import numpy as np
import pytest

import braidcast
from braidcast import InputError, load_model
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.model_file import save_model


@pytest.fixture
def file(model: SurrogateModel, tmp_path: Path) -> Path:
    save_model(model, tmp_path / "model.npz")
    return tmp_path / "model.npz"


def rewritten(file: Path, **header: object) -> None:
    """Change the header of a model file and leave the rest."""
    with np.load(file) as stored:
        arrays = {key: stored[key] for key in stored.files}
    text = json.loads(str(arrays["header"][()])) | header
    arrays["header"] = np.array(json.dumps(text, sort_keys=True))
    np.savez(file, **arrays)


def test_predicts_the_same_to_the_last_bit(model: SurrogateModel, file: Path) -> None:
    again = load_model(file)
    ours, theirs = model.predict(model.case), again.predict(model.case)
    assert np.array_equal(ours.positions, theirs.positions)
    assert np.array_equal(ours.std, theirs.std)
    assert ours.success_probability == theirs.success_probability
    assert again.record == json.loads(json.dumps(model.record))
    assert again.applicability == model.applicability


def test_carries_what_it_is(file: Path) -> None:
    with np.load(file, allow_pickle=False) as stored:
        header = json.loads(str(stored["header"][()]))
    assert header["units"] == "mm, N, MPa, tonne, s"
    assert header["device"]["wires"] == 12
    assert header["limits"]["vessel_diameter"] == [2.5, 3.5]
    assert header["record"]["versions"]["braidcast"] == braidcast.__version__
    assert header["record"]["test"]["shapes"]["cases"] > 0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999])
def test_cut_short(file: Path, share: float) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match="is not a model file, must be as `braidcast train`"):
        load_model(file)


def test_edited(file: Path) -> None:
    rewritten(file, threshold=0.1)
    with pytest.raises(InputError, match="was changed after it was written"):
        load_model(file)


def test_newer(file: Path) -> None:
    rewritten(file, model_version=2)
    with pytest.raises(InputError, match="model_version = 2 must be at most 1: the model was"):
        load_model(file)


def test_code_in_a_file_is_not_run(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return (Path.touch, (tmp_path / "sprung",))  # type: ignore[return-value]

    stream = io.BytesIO()
    np.savez(stream, header=np.array(Trap(), dtype=object), checksum=np.array(""))
    (tmp_path / "trap.npz").write_bytes(stream.getvalue())
    with pytest.raises(InputError, match="is not a model file"):
        load_model(tmp_path / "trap.npz")
    assert not (tmp_path / "sprung").exists()


def test_other_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        load_model(tmp_path / "none.npz")
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(InputError, match="is not a model file"):
        load_model(tmp_path / "array.npy")
