"""Model files: arrays and one text of JSON in NumPy's npz, with a checksum; nothing is executed.

The header names the recipe, the device, the ranges the model was trained for, its units, versions
and test figures. Files of a higher ``model_version`` are not for this braidcast.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from braidcast.atomic import write_atomically
from braidcast.case import Case
from braidcast.errors import InputError
from braidcast.surrogate.applicability import Applicability
from braidcast.surrogate.ends import EndsClassifier
from braidcast.surrogate.gaussian_process import GaussianProcesses
from braidcast.surrogate.model import SurrogateModel
from braidcast.surrogate.pod import Basis
from braidcast.surrogate.recipes import RECIPES

MODEL_VERSION = 1

UNITS = "mm, N, MPa, tonne, s"

SHIPPED = "shipped_model.npz"

_PROCESSES = tuple(GaussianProcesses.__dataclass_fields__)
_ENDS = ("offset_", "scale_", "coefficients_")
_NOT_A_MODEL = "is not a model file, must be as `braidcast train` writes it"


def load_model(path: str | Path | None = None) -> SurrogateModel:
    """The model in a file, by default the one that ships with braidcast.

    ``InputError`` if the file is no model, was cut short or changed, or is of a newer braidcast.
    """
    if path is None:
        return _model(files("braidcast.surrogate").joinpath(SHIPPED).read_bytes(), SHIPPED)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"model file = {path} cannot be read: {error.strerror or error}") from None
    return _model(content, str(path))


def save_model(model: SurrogateModel, path: str | Path) -> None:
    """Write a model to a file, whole or not at all."""
    arrays = {
        "numbers": model.numbers,
        "predictor_offset": model.rom.offset_,
        "predictor_scale": model.rom.scale_,
        "left_out": model.rom.left_out_,
        "basis_mean": model.rom.basis_.mean,
        "basis_modes": model.rom.basis_.modes,
        "singular_values": model.rom.basis_.singular_values,
        "weights": model.rom.processes_.weights,
        **{f"processes_{name}": getattr(model.rom.processes_, name) for name in _PROCESSES},
        **{f"ends_{name}": getattr(model.ends, name) for name in _ENDS},
    }
    header = {
        "model_version": MODEL_VERSION,
        "units": UNITS,
        "recipe": model.recipe.name,
        "predictors": list(model.recipe.names),
        "case": model.case.to_dict(),
        "device": dict(model.applicability.device),
        "limits": {name: list(ends) for name, ends in model.applicability.limits.items()},
        "threshold": model.threshold,
        "interval_factor": model.interval_factor,
        "ends_intercept": model.ends.intercept_,
        "record": dict(model.record),
    }
    text = json.dumps(header, sort_keys=True)
    stream = io.BytesIO()
    np.savez_compressed(
        stream, header=np.array(text), checksum=np.array(_checksum(text, arrays)), **arrays
    )
    write_atomically(Path(path), stream.getvalue())


def _model(content: bytes, name: str) -> SurrogateModel:
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            arrays = {key: stored[key] for key in stored.files}
        text, checksum = str(arrays.pop("header")[()]), str(arrays.pop("checksum")[()])
        header = json.loads(text)
        kind = header["model_version"]
    except (ValueError, KeyError, TypeError, EOFError, OSError, zipfile.BadZipFile, RecursionError):
        raise InputError(f"model file = {name} {_NOT_A_MODEL}") from None
    if isinstance(kind, int) and kind > MODEL_VERSION:
        raise InputError(
            f"model file = {name}: model_version = {kind} must be at most {MODEL_VERSION}: the "
            "model was written by a newer braidcast"
        )
    if checksum != _checksum(text, arrays):
        raise InputError(
            f"model file = {name} was changed after it was written, must be as `braidcast train` "
            "writes it"
        )
    if header["recipe"] not in RECIPES or tuple(header["predictors"]) != (
        RECIPES[header["recipe"]].names
    ):
        raise InputError(
            f"model file = {name}: recipe = {header['recipe']!r} with its predictors must be one "
            f"of this braidcast's: {', '.join(RECIPES)}; train the model again"
        )
    return _built(header, arrays)


def _built(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> SurrogateModel:
    recipe, case = RECIPES[header["recipe"]], Case.from_dict(header["case"])
    rom = recipe.reduced_order_model([case], len(arrays["basis_modes"]))
    rom.n_features_in_ = len(recipe.names)
    rom.offset_, rom.scale_ = arrays["predictor_offset"], arrays["predictor_scale"]
    rom.left_out_ = arrays["left_out"]
    rom.basis_ = Basis(arrays["basis_mean"], arrays["basis_modes"], arrays["singular_values"])
    processes = GaussianProcesses(*(arrays[f"processes_{name}"] for name in _PROCESSES))
    # saved, because to find them again takes half a second
    processes.__dict__["weights"] = arrays["weights"]
    rom.processes_ = processes
    ends = EndsClassifier()
    for name in _ENDS:
        setattr(ends, name, arrays[f"ends_{name}"])
    ends.intercept_, ends.classes_ = header["ends_intercept"], np.array([False, True])
    limits = {name: (low, high) for name, (low, high) in header["limits"].items()}
    return SurrogateModel(
        recipe=recipe,
        rom=rom,
        ends=ends,
        threshold=header["threshold"],
        interval_factor=header["interval_factor"],
        applicability=Applicability(header["device"], limits),
        case=case,
        numbers=arrays["numbers"],
        record=header["record"],
    )


def _checksum(text: str, arrays: Mapping[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256(text.encode())
    for name in sorted(arrays):
        value = arrays[name]
        digest.update(f"\0{name}\0{value.dtype.str}\0{value.shape}\0".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()
