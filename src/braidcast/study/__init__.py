"""The paper's study (Bisighini et al. 2023): its tables and figures beside the published ones.

Stages, each a function that reads the dataset and files of earlier stages and writes files of its
own, are listed in ``pipeline``, run by ``stages``, and put before the reader by ``report``.
"""

from pathlib import Path

PLAN = Path(__file__).with_name("plan.toml")
"""The plan of the 900 cases."""
