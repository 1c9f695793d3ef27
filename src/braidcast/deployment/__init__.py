"""From a case to a deployed braid: crimp, position, release."""
