"""A surrogate's arrays as the planner's page takes them, and the container they travel in.

A container is ``MAGIC``, the length of the header (uint32), the header as JSON, zeros up to a
multiple of 8 bytes, and the arrays as float64 one after another, all little-endian. The header's
``arrays`` lists their names and shapes in that order; the rest of it belongs to whoever packs.

The inverse Cholesky factors, thirteen times as large as all the rest, are not sent: the page
computes them from ``inputs`` and the hyper-parameters.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from braidcast.devices import catalogue
from braidcast.errors import InputError
from braidcast.surrogate.model import SurrogateModel

MAGIC = b"BRDCAST1"

_UNIT = 8


def pack(header: Mapping[str, Any], arrays: Mapping[str, ArrayLike]) -> bytes:
    """A container of values that JSON has, and of arrays of numbers by name."""
    stored = {name: np.asarray(array, dtype="<f8") for name, array in arrays.items()}
    listed = [{"name": name, "shape": list(array.shape)} for name, array in stored.items()]
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    start = MAGIC + struct.pack("<I", len(text)) + text
    parts = [start, bytes(-len(start) % _UNIT), *(array.tobytes() for array in stored.values())]
    return b"".join(parts)


def unpack(content: bytes) -> tuple[dict[str, Any], dict[str, NDArray[np.float64]]]:
    """The header and the arrays of a container that ``pack`` made."""
    (length,) = struct.unpack_from("<I", content, len(MAGIC))
    begin = len(MAGIC) + 4
    header = json.loads(content[begin : begin + length])
    place = begin + length + (-(begin + length) % _UNIT)
    arrays = {}
    for entry in header.pop("arrays"):
        count = int(np.prod(entry["shape"], dtype=np.int64))
        array = np.frombuffer(content, "<f8", count, place)
        arrays[entry["name"]] = array.reshape(entry["shape"])
        place += array.nbytes
    return header, arrays


def model_bytes(model: SurrogateModel) -> bytes:
    """All that a prediction needs, packed; ``InputError`` for a model of another recipe than ours.

    ``modes`` are (N, L, 3), the components of all modes at a node side by side, because the page
    goes through them node by node.
    """
    if model.recipe.name != "ours":
        raise InputError(
            f"model = {model.record['name']} is of the recipe {model.recipe.name!r}, must be of "
            "the recipe 'ours', the only one that the planner evaluates"
        )
    rom, processes, ends = model.rom, model.rom.processes_, model.ends
    modes = rom.basis_.modes.reshape(len(rom.basis_.modes), -1, 3)
    header = {
        "name": str(model.record["name"]),
        "case": model.case.to_dict(),
        "device": dict(model.applicability.device),
        "catalogue": {name: asdict(braid) for name, braid in catalogue.items()},
        "limits": {name: list(limits) for name, limits in model.applicability.limits.items()},
        "threshold": model.threshold,
        "interval_factor": model.interval_factor,
        "ends_intercept": ends.intercept_,
    }
    arrays = {
        "predictor_offset": rom.offset_,
        "predictor_scale": rom.scale_,
        "mean": rom.basis_.mean,
        "modes": modes.transpose(1, 0, 2),
        "left_out": rom.left_out_,
        "inputs": processes.inputs,
        "weights": processes.weights.T,
        "length_scales": processes.length_scales,
        "signal": processes.signal,
        "noise": processes.noise,
        "offset": processes.offset,
        "mirror": processes.mirror,
        "parity": processes.parity,
        "ends_offset": ends.offset_,
        "ends_scale": ends.scale_,
        "ends_coefficients": ends.coefficients_,
        "numbers": model.numbers,
    }
    return pack(header, arrays)
