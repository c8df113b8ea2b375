import pytest

from policy.training.schedule import rate_factor


def _factors(schedule: str, warmup: int) -> list[float]:
    return [
        rate_factor(step, schedule=schedule, warmup=warmup, num_steps=50)  # type: ignore[arg-type]
        for step in range(50)
    ]


def test_constant_after_a_linear_rise() -> None:
    factors = _factors("constant", 10)
    assert factors[:10] == pytest.approx([i / 10 for i in range(1, 11)])
    assert factors[10:] == [1.0] * 40


def test_cosine_falls_to_almost_nothing_but_never_stops() -> None:
    factors = _factors("cosine", 10)
    assert max(factors) == factors[9] == factors[10] == 1.0
    assert factors[30] == pytest.approx(0.5)
    assert factors[10:] == sorted(factors[10:], reverse=True) and 0 < factors[-1] < 0.01


def test_no_warmup() -> None:
    assert _factors("constant", 0) == [1.0] * 50
