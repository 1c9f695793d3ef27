"""Braided stents in vessels with an aneurysm: their deployment, simulated and predicted.

>>> import braidcast
>>> case = braidcast.Case.from_toml("examples/success.toml")
>>> deployment = braidcast.simulate(case)
>>> deployment.outcome
'success'
>>> prediction = braidcast.load_model().predict(case)
>>> prediction.outcome
'success'
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from braidcast.case import Case
    from braidcast.dataset.store import open_dataset
    from braidcast.deployment.output import write_deployment
    from braidcast.deployment.result import Deployment
    from braidcast.deployment.simulate import simulate
    from braidcast.errors import InputError
    from braidcast.surrogate.model import SurrogateModel
    from braidcast.surrogate.model_file import load_model
    from braidcast.surrogate.output import write_prediction
    from braidcast.surrogate.prediction import Prediction

__version__ = "0.1.0"

__all__ = [
    "Case",
    "Deployment",
    "InputError",
    "Prediction",
    "SurrogateModel",
    "__version__",
    "load_model",
    "open_dataset",
    "simulate",
    "write_deployment",
    "write_prediction",
]

_homes = {
    "Case": "braidcast.case",
    "Deployment": "braidcast.deployment.result",
    "InputError": "braidcast.errors",
    "Prediction": "braidcast.surrogate.prediction",
    "SurrogateModel": "braidcast.surrogate.model",
    "load_model": "braidcast.surrogate.model_file",
    "open_dataset": "braidcast.dataset.store",
    "simulate": "braidcast.deployment.simulate",
    "write_deployment": "braidcast.deployment.output",
    "write_prediction": "braidcast.surrogate.output",
}


def __getattr__(name: str) -> object:
    """Import a public name when it is first asked for, so that ``--help`` need not wait."""
    if name not in _homes:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_homes[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
