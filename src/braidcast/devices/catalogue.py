"""Devices whose every dimension has a published source."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from braidcast.devices.braid import Braid

if TYPE_CHECKING:
    from collections.abc import Mapping

#: ``"paper"``: the 48-wire braid of the study this package reproduces (paper, section 2.1.1).
catalogue: Mapping[str, Braid] = MappingProxyType({"paper": Braid()})
