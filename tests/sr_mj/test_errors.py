import pytest

from sr_mj.errors import (
    ConfigError,
    RenderError,
    SceneError,
    SrMjError,
    UnknownNameError,
    unknown_name_message,
)


@pytest.mark.parametrize(
    ("leaf", "builtin"),
    [
        (ConfigError, ValueError),
        (RenderError, RuntimeError),
        (SceneError, RuntimeError),
        (UnknownNameError, KeyError),
    ],
)
def test_leaves_derive_from_the_base_and_from_the_builtin(leaf, builtin):
    assert issubclass(leaf, SrMjError)
    assert issubclass(leaf, builtin)
    assert str(leaf("one line")) == "one line"


@pytest.mark.parametrize(
    ("name", "names", "message"),
    [
        (
            "cluttered51",
            ("cluttered15", "place8"),
            "Unknown scene 'cluttered51'. Scenes: cluttered15, place8. Did you mean 'cluttered15'?",
        ),
        ("zzz", ("cluttered15", "place8"), "Unknown scene 'zzz'. Scenes: cluttered15, place8."),
        ("zzz", (), "Unknown scene 'zzz'. Scenes: none."),
    ],
)
def test_unknown_name_message(name, names, message):
    assert unknown_name_message("scene", name, names) == message
