"""Errors of filters predicted without runs, and small models found by them."""

from gmwm.ins.covariance.reduction import reduce as reduce
