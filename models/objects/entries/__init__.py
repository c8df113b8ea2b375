"""The catalogue's entries, as data: one module a group, one tuple a split."""

from models.objects.entries.seen_care import SEEN_CARE
from models.objects.entries.seen_food import SEEN_FOOD
from models.objects.entries.seen_home import SEEN_HOME
from models.objects.entries.seen_play import SEEN_PLAY
from models.objects.entries.seen_table import SEEN_TABLE
from models.objects.entries.seen_tools import SEEN_TOOLS
from models.objects.entries.seen_toys import SEEN_TOYS
from models.objects.entries.unseen_care import UNSEEN_CARE
from models.objects.entries.unseen_home import UNSEEN_HOME
from models.objects.entries.unseen_more import UNSEEN_MORE

SEEN = (
    *SEEN_FOOD,
    *SEEN_HOME,
    *SEEN_CARE,
    *SEEN_TOYS,
    *SEEN_TABLE,
    *SEEN_PLAY,
    *SEEN_TOOLS,
)
UNSEEN = (*UNSEEN_CARE, *UNSEEN_HOME, *UNSEEN_MORE)
