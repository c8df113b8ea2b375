import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn.functional import softplus

from policy.network.batch import PHASES, collate, make_sample
from policy.network.config import SRConfig
from policy.network.evidence import CandidateEvidence, Evidence, mask_nearness
from policy.network.model import SRNetwork


def _random(module: CandidateEvidence) -> CandidateEvidence:
    torch.manual_seed(0)
    for parameter in module.parameters():
        torch.nn.init.normal_(parameter)
    return module


def test_nearness_equals_the_equation() -> None:
    torch.manual_seed(0)
    radial, mask = torch.rand(2, 3, 4, 5).double(), torch.rand(2, 6, 5).double()
    mask[1, :, 3:] = 0.0
    nearness = mask_nearness(radial, mask)
    for i in range(2):
        for s in range(3):
            for c in range(4):
                m = [sum(mask[i, h, p].item() for h in range(6)) / 6 for p in range(5)]
                mean = sum(m[p] * radial[i, s, c, p].item() for p in range(5)) / sum(m)
                assert nearness[i, s, c].item() == pytest.approx(math.log(mean), abs=1e-9)


def test_nearness_without_points_prefers_nothing() -> None:
    nearness = mask_nearness(torch.rand(1, 3, 4, 1), torch.zeros(1, 6, 1))
    assert nearness.isfinite().all()
    assert len(nearness.unique()) == 1


def test_evidence_adds_up() -> None:
    config = SRConfig(feature_dim=16, width=32, num_heads=4)
    weigh = _random(CandidateEvidence(config))
    phase = torch.tensor([0, 3])
    prior, readout, nearness = torch.rand(2, 5), torch.rand(2, 4, 5), -torch.rand(2, 6, 5)
    got = weigh(phase, Evidence(prior=prior, readout=readout, nearness=nearness))
    assert weigh.prior_weight is not None
    assert weigh.mask_weight is not None
    assert weigh.nearness_weight is not None
    for i, p in enumerate(phase.tolist()):
        expected = softplus(weigh.prior_weight[p]) * prior[i]
        expected = expected + weigh.mask_weight[p] @ readout[i]
        expected = expected + weigh.nearness_weight[p] @ nearness[i]
        torch.testing.assert_close(got[i], expected)


@pytest.mark.parametrize("phase", range(1, len(PHASES)))
def test_nearness_says_nothing_of_places_at_the_start(phase: int) -> None:
    evidence = CandidateEvidence(SRConfig(feature_dim=16, width=32, num_heads=4))
    assert evidence.nearness_weight is not None
    assert not evidence.nearness_weight[phase].any()
    assert evidence.nearness_weight[0].any()


def test_untrained_network_takes_what_is_nearest_to_a_target_without_grasps(
    rng: np.random.Generator, make_observation, make_candidates, make_config
) -> None:
    torch.manual_seed(0)
    config = make_config("sr")
    networks = [SRNetwork(replace(config, mask_nearness=on)) for on in (False, True)]
    hits = [0, 0]
    for _ in range(20):
        observation = make_observation(rng, 60)
        points, similarity = observation.points.copy(), observation.similarity.copy()
        # A target in the middle; grasps 8 to 20 cm from it, none on it.
        points[:10] = [0.5, 0.0, 0.05]
        similarity[:10] = 1.0
        observation = replace(observation, points=points, similarity=similarity)
        candidates = make_candidates(rng, 6)
        poses = candidates.Ts_world_tool.copy()
        distance_m, angle = rng.permutation(np.linspace(0.08, 0.2, 6)), rng.uniform(0, 6.28, 6)
        poses[:, 0, 3] = 0.5 + distance_m * np.cos(angle)
        poses[:, 1, 3] = distance_m * np.sin(angle)
        poses[:, 2, 3] = 0.05
        batch = collate(
            [make_sample(observation, replace(candidates, Ts_world_tool=poses), config)]
        )
        for i, network in enumerate(networks):
            hits[i] += int(network(batch).logits[0].argmax()) == int(distance_m.argmin())
    assert hits[1] >= 19
    assert hits[1] > hits[0]
