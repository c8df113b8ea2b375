"""Which variants there are, what they are called, and that a seed decides all of it."""

import hashlib
import importlib
import inspect
import pkgutil
import subprocess
import sys
from functools import partial

import numpy as np
import pytest

from models.errors import UnknownNameError
from models.objects import families
from models.objects.asset import Shape
from models.objects.cache import decode, encode
from models.objects.entries import SEEN, UNSEEN
from models.objects.variants.draft import Draft

CATALOGUE = (*SEEN, *UNSEEN)


def test_every_family_function_is_sampled():
    found = set()
    for info in pkgutil.iter_modules(families.__path__):
        module = importlib.import_module(f"{families.__name__}.{info.name}")
        for name, function in inspect.getmembers(module, inspect.isfunction):
            is_own = function.__module__ == module.__name__ and not name.startswith("_")
            if is_own and inspect.signature(function).return_annotation is Shape:
                found.add(name)
    assert found == set(families.FAMILIES)


def test_catalogue_families_are_sampled():
    assert {entry.family for entry in CATALOGUE} <= set(families.FAMILIES)


def test_unknown_family_says_what_was_meant():
    with pytest.raises(UnknownNameError) as caught:
        families.sample(np.random.default_rng(0), family="mugg")
    known = ", ".join(families.FAMILIES)
    assert str(caught.value) == f"Unknown family 'mugg'. Families: {known}. Did you mean 'mug'?"


def test_package_of_families_has_nothing_else_to_import():
    with pytest.raises(AttributeError, match="has no attribute 'smaple'"):
        _ = families.smaple


def test_names_follow_from_parameters(drafts):
    assert len({draft.name for draft in drafts}) == len(drafts)
    again = Draft(shape=partial(drafts[0].shape), words=drafts[1].words, matter=drafts[1].matter)
    assert again.name == drafts[0].name
    assert drafts[0].name.startswith("sample_") and len(drafts[0].name) == 15


def _digest(seed: int, count: int) -> str:
    rng = np.random.default_rng(seed)
    digest = hashlib.sha256()
    for _ in range(count):
        digest.update(encode(families.sample(rng)))
    return digest.hexdigest()


def test_same_seed_gives_the_same_bytes_in_every_process():
    program = (
        "import sys, hashlib, numpy as np\n"
        "from models.objects import families\n"
        "from models.objects.cache import encode\n"
        "rng = np.random.default_rng(21)\n"
        "digest = hashlib.sha256()\n"
        "for _ in range(8): digest.update(encode(families.sample(rng)))\n"
        "print(digest.hexdigest())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.strip() == _digest(21, 8) != _digest(22, 8)


def test_a_variant_survives_the_encoding_of_the_cache(assets):
    asset = assets("mug")[0]
    assert encode(decode(encode(asset))) == encode(asset)
    assert asset.split == "sampled"
    assert asset.family == "mug"
