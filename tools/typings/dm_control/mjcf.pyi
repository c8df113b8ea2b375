# The attributes of MJCF elements are made from a schema at run time.
from typing import Any

def __getattr__(name: str) -> Any: ...
