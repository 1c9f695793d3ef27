"""Braided devices."""

from braidcast.devices.braid import Braid
from braidcast.devices.catalogue import catalogue

__all__ = ["Braid", "catalogue"]
