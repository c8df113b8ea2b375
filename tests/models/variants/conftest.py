"""Variants drawn once for all tests."""

import functools
from collections.abc import Callable

import numpy as np
import pytest

from models.objects import families
from models.objects.asset import ObjectAsset
from models.objects.variants import sampling
from models.objects.variants.draft import Draft

NUM_DRAFTS = 2500


@pytest.fixture(scope="session")
def drafts() -> tuple[Draft, ...]:
    """Many draws of all families."""
    rng = np.random.default_rng(7)
    return tuple(sampling.draw(rng) for _ in range(NUM_DRAFTS))


@pytest.fixture(scope="session")
def assets() -> Callable[[str], tuple[ObjectAsset, ...]]:
    """Makes two variants of a family, once."""

    @functools.cache
    def make(family: str) -> tuple[ObjectAsset, ...]:
        rng = np.random.default_rng(11)
        return tuple(families.sample(rng, family=family) for _ in range(2))

    return make
