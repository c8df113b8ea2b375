import json

import pytest
from dm_control import mjcf

from models.errors import CatalogueFolderError, UnknownNameError
from models.objects.cache import encode
from models.objects.catalogue import build_asset
from models.objects.folder_catalogue import FolderCatalogue
from models.objects.mjcf_builder import build_object
from models.objects.mjcf_object import content_hash


@pytest.fixture
def folder(tmp_path):
    data = encode(build_asset("apple"))
    (tmp_path / "object.npz").write_bytes(data)
    entry = {
        "words": {"label": "scanned apple", "colors": ["red"]},
        "kind": "mesh",
        "file": "object.npz",
        "hash": content_hash(data),
        "key": "k",
        "source": "005",
        "graspnet_id": "005",
    }
    index = {"format": 1, "objects": {"apple": entry}}
    (tmp_path / "catalogue.json").write_text(json.dumps(index))
    return tmp_path


def test_objects_come_back_with_the_words_of_the_index(folder):
    catalogue = FolderCatalogue(folder)
    assert catalogue.names("seen") == catalogue.names() == ("apple",)
    assert catalogue.words("apple").colors == ("red",)
    item = catalogue.load("apple")
    assert item.words.label == "scanned apple"
    assert mjcf.Physics.from_mjcf_model(build_object(item)).model.body("object").mass[0] > 0
    assert catalogue.by_graspnet_id("5") == catalogue.by_graspnet_id(5) == "apple"
    assert catalogue.by_graspnet_id("006") is None


def test_unknown_names_and_damage_are_told(folder):
    catalogue = FolderCatalogue(folder)
    with pytest.raises(UnknownNameError, match="Did you mean 'apple'"):
        catalogue.load("aple")
    (folder / "object.npz").write_bytes(b"half")
    with pytest.raises(CatalogueFolderError, match=r"'apple' in .* is damaged .*import it again"):
        catalogue.load("apple")


def test_a_folder_without_index_is_no_catalogue(tmp_path):
    with pytest.raises(CatalogueFolderError, match=r"it has no catalogue\.json"):
        FolderCatalogue(tmp_path)
