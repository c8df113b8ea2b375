from policy.baselines.a2 import A2Config
from policy.network.config import SRConfig, ablation_switches
from policy.network.kinds import make_network
from policy.network.mixing import mixing_weights


def _sr(name):
    return SRConfig(feature_dim=16, width=32, num_heads=4, **ablation_switches(name))


def test_all_that_weighs_scores_and_nothing_else() -> None:
    network = make_network(_sr("sr"))
    found = mixing_weights(network)
    assert list(found) == [
        "language_alignment.pooled_advantage",
        "language_alignment.similarity_sharpness",
        "dssa_layers.0.beta",
        "dssa_layers.0.bias.weight",
        "dssa_layers.1.beta",
        "dssa_layers.1.bias.weight",
        "action_alignment.bias.weight",
        "evidence.prior_weight",
        "evidence.mask_weight",
        "evidence.nearness_weight",
    ]
    parameters = dict(network.named_parameters())
    assert all(parameters[name] is parameter for name, parameter in found.items())


def test_what_a_network_lacks_is_not_among_them() -> None:
    base = mixing_weights(make_network(_sr("base")))
    assert list(base) == ["action_alignment.bias.weight", "evidence.prior_weight"]
    a2 = A2Config(feature_dim=16, width=32, num_heads=4, prior=False)
    assert not mixing_weights(make_network(a2))
