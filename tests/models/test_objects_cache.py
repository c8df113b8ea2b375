import os

import numpy as np
import pytest

from models.objects import cache
from models.objects.catalogue import build_asset, load_object


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SR_MJ_CACHE", str(tmp_path / "cache"))


def test_round_trip_keeps_every_field():
    asset = build_asset("red_mug")
    again = cache.decode(cache.encode(asset))
    assert cache.encode(again) == cache.encode(asset)
    assert again.words == asset.words
    np.testing.assert_array_equal(again.vertices, asset.vertices)
    assert [(p.kind, p.size, p.position, p.quat_wxyz) for p in again.collision] == [
        (p.kind, p.size, p.position, p.quat_wxyz) for p in asset.collision
    ]


def test_load_writes_one_file_and_reads_it_back():
    first = load_object("apple")
    path = cache.entry_path("apple")
    written = path.read_bytes()
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    assert cache.encode(load_object("apple")) == cache.encode(first) == written


def test_second_load_does_not_build():
    load_object("apple")

    def refuse():
        raise AssertionError("built although cached")

    assert cache.load_or_build("apple", refuse).name == "apple"


@pytest.mark.parametrize("damage", [b"", b"not a zip", "truncate", "flip"])
def test_damaged_entry_is_rebuilt(damage):
    load_object("lemon")
    path = cache.entry_path("lemon")
    good = path.read_bytes()
    if damage == "truncate":
        bad = good[: len(good) // 2]
    elif damage == "flip":
        middle = len(good) // 2
        bad = good[:middle] + bytes([good[middle] ^ 0xFF]) + good[middle + 1 :]
    else:
        bad = damage
    path.write_bytes(bad)
    assert load_object("lemon").name == "lemon"
    assert path.read_bytes() == good


def test_unwritable_cache_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("SR_MJ_CACHE", str(blocked))
    assert load_object("plum").name == "plum"


def test_cache_directory_follows_the_environment(tmp_path, monkeypatch):
    assert cache.cache_dir() == tmp_path / "cache"
    monkeypatch.delenv("SR_MJ_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache.cache_dir() == tmp_path / "xdg" / "sr_mj"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", os.fspath(tmp_path))
    assert cache.cache_dir() == tmp_path / ".cache" / "sr_mj"
