import re

import pytest

from policy.errors import InvalidConfigError
from sr_mj.assemble import lifter_for
from sr_mj.errors import UnknownNameError
from sr_mj.evaluation.statistics import wilson
from sr_mj.oracle import OraclePolicy
from tools.bench.first_choice import FirstChoiceConfig, decisions, main
from tools.bench.grounding_scenes import photograph
from tools.table_text import percent


def test_right_choices_are_grasps_on_what_is_asked_for():
    bench = photograph("pickplace8", "seen", 100)
    oracle = OraclePolicy(bench.scene)
    asked = decisions(bench, lifter_for(bench.scene.workspace, "embedded"))
    assert len(asked) >= 4
    gripped = oracle.gripped(asked[0].candidates)
    meant_by = []
    for decision in asked:
        candidates, is_right = decision.candidates, decision.is_right
        assert 0 < is_right.sum() < len(candidates)
        meant = set(gripped[is_right])
        assert "" not in meant and not meant & set(gripped[~is_right])
        assert oracle.distances(sorted(meant), candidates.positions[is_right]).max() < 0.03
        meant_by.append(meant)
    # Different questions are about different things.
    assert any(not one & other for one in meant_by for other in meant_by)


def test_the_table_has_a_row_for_every_policy(capsys):
    config = FirstChoiceConfig(scene="single", seeds=(0, 1), policies=("grounding", "random"))
    assert main(config) == 0
    heading, _, *rows = capsys.readouterr().out.splitlines()
    found = re.fullmatch(r"\| policy \| `single`, (\d+) questions \| seconds \|", heading)
    assert found and int(found[1]) >= 1
    # There is nothing else that could be grasped.
    everything = percent(wilson(int(found[1]), int(found[1])))
    assert [row.split(" | ")[:2] for row in rows] == [
        ["| `grounding` (no weights)", everything],
        ["| `random`", everything],
    ]


def test_bad_options_are_refused():
    with pytest.raises(InvalidConfigError, match=r"policies: got none"):
        FirstChoiceConfig(policies=())
    with pytest.raises(UnknownNameError, match=r"Unknown policy 'groundin'"):
        main(FirstChoiceConfig(policies=("groundin",)))
    with pytest.raises(InvalidConfigError, match=r"seeds: got \(0, 1\), among which nothing"):
        main(FirstChoiceConfig(scene="empty", seeds=(0, 1), policies=("random",)))
