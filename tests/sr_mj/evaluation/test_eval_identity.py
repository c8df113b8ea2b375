import json
import operator
from dataclasses import replace

import pytest

from sr_mj.errors import ConfigError
from sr_mj.evaluation.identity import PLAIN_MAKER, Identity, card_hash, weights_hash
from sr_mj.evaluation.plan import Episode, PolicyChoice, read_policies
from sr_mj.evaluation.setting import Setting
from sr_mj.evaluation.worker import Worker

CARD = {"format": 1, "kind": "sr", "config": {"max_points": 128}, "encoder": "e", "training": {}}


@pytest.fixture
def trained(tmp_path):
    """Return a function that writes weights and a card, and returns the choice of them."""

    def write(folder, weights=b"weights", **changes):
        path = tmp_path / folder / "best.safetensors"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(weights)
        path.with_suffix(".json").write_text(json.dumps(CARD | changes))
        return read_policies([f"sr@{path}"])[-1]

    return write


def setting_of(*choices, **changes):
    return Setting(policies=(*read_policies([]), *choices), **changes)


def of_policy(label, seed=0, **changes):
    where = {"task": "grasp", "scene": "grasp-seen-00", **changes}
    return Episode(split="seen", condition="clean", seed=seed, policy=label, **where)


def message_of(setting, episode, record):
    with pytest.raises(ConfigError) as error:
        Identity(setting).check(episode, record)
    return str(error.value)


def test_shipped_weights_have_both_hashes():
    for name in ("sr", "sr-a", "a2"):
        choice = PolicyChoice(label=name, name=name)
        assert len(weights_hash(choice) or "") == len(card_hash(choice) or "") == 64
    blind = PolicyChoice(label="random", name="random")
    assert weights_hash(blind) is card_hash(blind) is None


def test_the_card_counts_by_what_is_loaded_from_it(trained):
    first = trained("a")
    known = card_hash(first)
    assert card_hash(trained("b", training={"epochs": 3}, weights=b"others")) == known
    different = (
        {"config": {"max_points": 64}},
        {"config": {"max_points": 128, "sparsifier": "relu"}},
        {"kind": "a2"},
        {"encoder": "f"},
    )
    hashes = [card_hash(trained("c", **changes)) for changes in different]
    assert len({known, *hashes}) == 5 and None not in hashes
    first.checkpoint.with_suffix(".json").write_text("[]")
    assert card_hash(first) is None


def test_results_of_other_weights_under_one_label_are_not_resumed(trained):
    """Neither those that are planned again nor those that are not."""
    before = setting_of(trained("a"))
    episode = of_policy("sr@best")
    record = Identity(before).of(episode)
    Identity(before).check(episode, record)
    others = message_of(setting_of(trained("b", weights=b"others")), episode, record)
    assert others == (
        f"The results to resume have weights_sha256 '{record['weights_sha256']}' in episode "
        "grasp-seen-00_seen_clean_0000_sr@best, this run has "
        f"'{weights_hash(trained('b', weights=b'others'))}'; use the same options and files, or a "
        "new --out."
    )
    card = message_of(setting_of(trained("b", config={"max_points": 64})), episode, record)
    assert card.startswith("The results to resume have card_sha256 ")


@pytest.mark.parametrize(
    ("name", "value", "field"),
    [
        ("attempts", 3, "max_attempts"),
        ("cameras", "a2", "cameras"),
        ("generator", "file", "generator"),
        ("keep_unreachable", True, "keep_unreachable"),
        ("encoder_fingerprint", "f", "encoder_fingerprint"),
        ("encoder", "other", "encoder"),
    ],
)
def test_results_of_a_policy_that_does_not_run_now_are_held_to_the_options(
    trained, name, value, field
):
    before, episode = setting_of(trained("a")), of_policy("sr@best")
    record = Identity(before).of(episode)
    Identity(setting_of()).check(episode, record)
    found = message_of(setting_of(**{name: value}), episode, record)
    assert found.startswith(f"The results to resume have {field} ")
    # Who does not look does not mind the encoder.
    blind = of_policy("random")
    after = setting_of(**{name: value})
    if field.startswith("encoder"):
        Identity(after).check(blind, Identity(before).of(blind))


def test_arrangements_that_were_made_anew_are_not_resumed():
    setting, episode = setting_of(), of_policy("random", seed=77)
    record = {**Identity(setting).of(episode), "arrangement_sha256": "0"}
    assert "have arrangement_sha256 '0' in episode" in message_of(setting, episode, record)
    gone = of_policy("random", scene="grasp-seen-99")
    assert "have arrangement_sha256 '0' in episode" in message_of(setting, gone, record)


def test_the_maker_of_random_scenes_belongs_to_the_result():
    plain, other = setting_of(), setting_of(scene_makers={"place8": operator.index})
    place = of_policy("random", task="random-place8", scene="place8")
    heap = of_policy("random", task="random-cluttered15", scene="cluttered15")
    assert Identity(plain).of(place)["scene_maker"] == PLAIN_MAKER
    assert Identity(other).of(place)["scene_maker"] == "_operator.index"
    assert Identity(other).of(heap) == Identity(plain).of(heap)
    assert Identity(plain).of(of_policy("random"))["scene_maker"] is None
    found = message_of(other, place, Identity(plain).of(place))
    assert f"have scene_maker '{PLAIN_MAKER}' in episode" in found
    # The maker that is named is the one that makes the scene.
    error = Worker(replace(other, attempts=1)).run(place).record["error"]
    assert error.startswith("TypeError: 'Episode' object cannot be interpreted as an integer")


def test_what_earlier_versions_did_not_write(trained):
    setting, fixed = setting_of(trained("a")), of_policy("sr@best")
    record = Identity(setting).of(fixed)
    del record["card_sha256"], record["scene_maker"]
    Identity(setting).check(fixed, record)
    # Nobody knows what kind of goals these scenes had.
    random = of_policy("random", task="random-place8", scene="place8")
    record = Identity(setting).of(random)
    del record["scene_maker"]
    assert "have no scene_maker in episode" in message_of(setting, random, record)
