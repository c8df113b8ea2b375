import numpy as np

from policy.baselines.random import RandomPolicy


def test_same_seed_same_scores(make_observation, make_candidates, rng: np.random.Generator) -> None:
    observation, candidates = make_observation(rng), make_candidates(rng)
    first, second = (
        RandomPolicy().score(observation, candidates, np.random.default_rng(3)).logits
        for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)


def test_choice_is_uniform(make_observation, make_candidates, rng: np.random.Generator) -> None:
    observation, candidates = make_observation(rng), make_candidates(rng, 4)
    draws = [RandomPolicy().score(observation, candidates, rng).best for _ in range(2000)]
    # Four standard deviations of a binomial count with n = 2000, p = 1/4.
    np.testing.assert_allclose(
        np.bincount(draws, minlength=4), 500, atol=4 * (2000 * 3 / 16) ** 0.5
    )


def test_no_candidates(make_observation, make_candidates, rng: np.random.Generator) -> None:
    scores = RandomPolicy().score(make_observation(rng), make_candidates(rng, 0), rng)
    assert len(scores) == 0
