"""The catalogue's entries, as data: one module a group, one tuple a split."""

from models.objects.entries.seen_care import SEEN_CARE
from models.objects.entries.seen_food import SEEN_FOOD
from models.objects.entries.seen_home import SEEN_HOME
from models.objects.entries.seen_toys import SEEN_TOYS
from models.objects.entries.unseen_care import UNSEEN_CARE
from models.objects.entries.unseen_home import UNSEEN_HOME

SEEN = (*SEEN_FOOD, *SEEN_HOME, *SEEN_CARE, *SEEN_TOYS)
UNSEEN = (*UNSEEN_CARE, *UNSEEN_HOME)
