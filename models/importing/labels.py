"""The words file: how people ask for imported objects, and what these weigh."""

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.errors import MissingPackageError, WordsFileError
from models.objects.words import CATEGORIES, COLORS, FUNCTIONS, SHAPES, ObjectWords

_TEXTS = ("name", "label", "category")
_LISTS: dict[str, tuple[str, ...] | None] = {
    "synonyms": None,
    "colors": COLORS,
    "shapes": SHAPES,
    "functions": FUNCTIONS,
}
_NUMBERS = ("mass_kg", "density_kg_m3")
_FIELDS = (*_TEXTS, *_LISTS, *_NUMBERS)
_NAME = re.compile(r"[a-z0-9][a-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class Label:
    """What the words file says about one object.

    Attributes:
        name: Name in the catalogue.
        words: How people ask for it.
        mass_kg: Mass, or None.
        density_kg_m3: Density, or None; never both.
    """

    name: str
    words: ObjectWords
    mass_kg: float | None = None
    density_kg_m3: float | None = None


def tidy_name(text: str) -> str:
    """Turn a file's or folder's name into a name for the catalogue.

    Args:
        text: Any text.

    Returns:
        Lower-case letters, digits and underscores.
    """
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_") or "object"


def label_from_stem(stem: str) -> Label:
    """Make words from a file's or folder's name alone, as in `011_banana`.

    Args:
        stem: The name; leading numbers, as YCB has them, are no word.

    Returns:
        The label.
    """
    noun = re.sub(r"^(\d+_([a-z]_)?)+(?=[a-z])", "", name_from_key(stem)).replace("_", " ")
    return Label(name=name_from_key(stem), words=ObjectWords(label=noun))


def read_labels(path: Path) -> dict[str, Label]:
    """Read a words file.

    Args:
        path: YAML: the name of an object's folder or file, then its fields.

    Returns:
        Label by key.

    Raises:
        WordsFileError: If the file cannot be used; the message says where and why.
        MissingPackageError: If PyYAML is not installed.
    """
    try:
        import yaml
    except ImportError:
        raise MissingPackageError(
            "PyYAML is not installed, it reads the words file; pip install '.[import]' in a clone"
        ) from None
    try:
        # Everything as text: YAML would read the key 010 as the number 8.
        node = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)
        tree = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise WordsFileError(f"{path} cannot be read ({reason}); name a words file.") from None
    except (yaml.YAMLError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise WordsFileError(f"{path} is not YAML ({reason}); see docs/importing.md.") from None
    if not isinstance(tree, dict) or not isinstance(node, yaml.MappingNode):
        raise WordsFileError(f"{path} has no objects; expected a name with fields a line.")
    _refuse_repeated([str(key.value) for key, _ in node.value], path, "object")
    labels = {key: _parse(path, key, fields) for key, fields in tree.items()}
    _refuse_repeated([label.name for label in labels.values()], path, "name")
    return labels


def _refuse_repeated(names: Iterable[str], path: Path, what: str) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise WordsFileError(f"{path} has the {what} {name!r} twice; keep one of them.")
        seen.add(name)


def _parse(path: Path, key: str, fields: Any) -> Label:
    """Check the fields of one object."""
    where = f"{path}: {key!r}"
    if not isinstance(fields, dict):
        raise WordsFileError(f"{where} has no fields; give at least a label.")
    for field in fields:
        if field not in _FIELDS:
            raise WordsFileError(f"{where} has an {_unknown('field', field, _FIELDS)}")
    texts = {field: _text(where, field, fields.get(field)) for field in _TEXTS}
    lists = {field: _list(where, field, fields.get(field)) for field in _LISTS}
    if texts["label"] is None and not (texts["category"] and lists["synonyms"]):
        raise WordsFileError(f"{where} has no label; give one, or a category and synonyms.")
    if texts["category"] not in (None, *CATEGORIES):
        raise WordsFileError(
            f"{where} has an {_unknown('category', str(texts['category']), CATEGORIES)}"
        )
    numbers = {field: _number(where, field, fields.get(field)) for field in _NUMBERS}
    if None not in numbers.values():
        raise WordsFileError(f"{where} has mass_kg and density_kg_m3; give one of them.")
    name = texts["name"] or name_from_key(key)
    if not _NAME.fullmatch(name):
        raise WordsFileError(
            f"{where} has the name {name!r}; expected lower-case letters, digits and _, such as "
            f"{tidy_name(name)!r}."
        )
    words = ObjectWords(label=texts["label"], category=texts["category"], **lists)
    return Label(name=name, words=words, **numbers)


def name_from_key(key: str) -> str:
    """Return the name of an object that has none of its own.

    Args:
        key: Its folder's or file's name; three digits are a number of GraspNet-1Billion.

    Returns:
        The name.
    """
    return f"graspnet_{key}" if re.fullmatch(r"\d{3}", key) else tidy_name(key)


def _text(where: str, field: str, value: Any) -> str | None:
    """Return a line of text; None for a missing or empty one."""
    if value is None or value in ("", "null", "~"):
        return None
    if not isinstance(value, str):
        raise WordsFileError(f"{where} has a {field} that is a {type(value).__name__}; give text.")
    return " ".join(value.split())


def _list(where: str, field: str, value: Any) -> tuple[str, ...]:
    """Return a list of words, each one known where the vocabulary is fixed."""
    items = [value] if isinstance(value, str) and value else value or []
    if not isinstance(items, list) or not all(isinstance(item, str) and item for item in items):
        raise WordsFileError(f"{where} has {field} that are no list of words; write [a, b].")
    known = _LISTS[field]
    for item in items:
        if known is not None and item not in known:
            raise WordsFileError(f"{where} has an {_unknown(f'entry of {field}', item, known)}")
    return tuple(" ".join(item.split()) for item in items)


def _number(where: str, field: str, value: Any) -> float | None:
    """Return a positive number, or None."""
    if value is None or value == "":
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not 0 < number < float("inf"):
        raise WordsFileError(f"{where} has {field} {value!r}; expected a positive number.")
    return number


def _unknown(kind: str, got: str, known: Iterable[str]) -> str:
    """Say what was found, what exists and what was probably meant."""
    names = list(known)
    close = difflib.get_close_matches(got, names, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    return f"unknown {kind} {got!r}; there are: {', '.join(names)}.{hint}"
