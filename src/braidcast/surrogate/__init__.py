"""The surrogate: the deployed braid from the case alone, learned from simulations."""
