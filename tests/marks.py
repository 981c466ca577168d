"""Marks of single parameters."""

from functools import partial

import pytest

LONG = partial(pytest.param, marks=pytest.mark.long)
"""A parameter whose test takes some seconds: others of the same test are in the default run."""
