"""A study of the dataset of a known law, with fewer samples where they make curves smoother."""

from collections.abc import Iterator

import pytest
from distributed import Client

from braidcast.dataset.folder import DatasetFolder
from braidcast.study import deployments, importance, learning
from braidcast.study.pipeline import pipeline
from braidcast.study.stages import run_stages
from braidcast.study.workspace import Study

SAMPLES = 90


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    # Not the default: xarray would hand it what other tests write.
    one = Client(
        processes=False,
        n_workers=1,
        threads_per_worker=1,
        dashboard_address="127.0.0.1:0",  # any free port: another worker of the tests may have one
        set_as_default=False,
    )
    with one:
        yield one


@pytest.fixture(scope="session")
def study(
    tmp_path_factory: pytest.TempPathFactory, store: DatasetFolder, client: Client
) -> Iterator[Study]:
    """The whole study, done."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importance, "SAMPLES", 16)
        patch.setattr(importance, "_TREES", 50)
        patch.setattr(learning, "_REPEATS", 3)
        patch.setattr(deployments, "SITES", 3)
        patch.setattr(deployments, "PREDICTED", 21)
        opened = Study(tmp_path_factory.mktemp("study"), store.path)
        run_stages(opened, pipeline(opened, SAMPLES), client)
        yield opened
