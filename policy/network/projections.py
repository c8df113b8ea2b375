"""What every attention with heads has in common: four projections, and the gathering of values."""

from jaxtyping import Float
from torch import Tensor, nn


def split_heads(x: Float[Tensor, "batch items width"], num_heads: int) -> Tensor:
    """Split channels into heads: (batch, items, width) to (batch, heads, items, head_dim)."""
    return x.unflatten(-1, (num_heads, -1)).transpose(1, 2)


def merge_heads(x: Float[Tensor, "batch heads items head_dim"]) -> Tensor:
    """Concatenate heads: (batch, heads, items, head_dim) to (batch, items, width)."""
    return x.transpose(1, 2).flatten(2)


class ProjectedAttention(nn.Module):
    """Attention of several heads, without the rule that makes the weights: that is a subclass's."""

    def __init__(self, width: int, num_heads: int, *, key_bias: bool) -> None:
        """Make the projections.

        Args:
            width: Channels of queries, keys, values and output.
            num_heads: Heads; divides the width.
            key_bias: Give the keys a bias.
        """
        super().__init__()
        self.num_heads = num_heads
        # Checkpoints know these by name, and seeds by the order in which they are made.
        self.query = nn.Linear(width, width)
        self.key = nn.Linear(width, width, bias=key_bias)
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)

    def queries_and_keys(
        self,
        queries: Float[Tensor, "batch queries width"],
        keys: Float[Tensor, "batch keys width"],
    ) -> tuple[
        Float[Tensor, "batch heads queries head_dim"], Float[Tensor, "batch heads keys head_dim"]
    ]:
        """Project what asks and what is asked, head by head.

        Args:
            queries: What asks.
            keys: What is compared with the queries.

        Returns:
            Both, split into heads.
        """
        q = split_heads(self.query(queries), self.num_heads)
        k = split_heads(self.key(keys), self.num_heads)
        return q, k

    def gather(
        self,
        weights: Float[Tensor, "batch heads queries keys"],
        values: Float[Tensor, "batch keys width"],
    ) -> Float[Tensor, "batch queries width"]:
        """Let every query gather values.

        Args:
            weights: Attention of every query on the keys.
            values: What is gathered.

        Returns:
            One row for each query; zeros plus the output bias where no key is valid.
        """
        v = split_heads(self.value(values), self.num_heads)
        return self.out(merge_heads(weights @ v))
