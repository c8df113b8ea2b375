import torch

from policy.network.morton import morton_codes, morton_order


def _interleave(cells: list[int]) -> int:
    return sum(
        ((cells[axis] >> bit) & 1) << (3 * bit + axis) for bit in range(16) for axis in range(3)
    )


def test_codes_interleave_bits() -> None:
    cells = torch.randint(0, 2**16, (500, 3), generator=torch.Generator().manual_seed(0))
    positions = cells.double() / (2**16 - 1) * 2 - 1
    assert morton_codes(positions).tolist() == [_interleave(row) for row in cells.tolist()]


def test_positions_outside_are_clamped() -> None:
    codes = morton_codes(torch.tensor([[-3.0, -1.0, -1.0], [5.0, 1.0, 1.0]]))
    assert codes.tolist() == [0, 2**48 - 1]


def test_order_puts_padding_last_and_ignores_the_input_order() -> None:
    generator = torch.Generator().manual_seed(0)
    positions = torch.rand(1, 30, 3, generator=generator) * 2 - 1
    mask = torch.ones(1, 30, dtype=torch.bool)
    mask[0, [3, 17]] = False
    order = morton_order(positions, mask)
    assert set(order[0, -2:].tolist()) == {3, 17}
    assert sorted(order[0].tolist()) == list(range(30))
    shuffle = torch.randperm(30, generator=generator)
    again = morton_order(positions[:, shuffle], mask[:, shuffle])
    torch.testing.assert_close(
        positions[0, order[0, :28]], positions[0, shuffle][again[0, :28]], rtol=0, atol=0
    )
