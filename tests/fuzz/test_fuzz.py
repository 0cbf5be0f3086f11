"""Whatever is found in the corpus, and whatever hypothesis thinks of: no traceback, no hang, little memory."""

from __future__ import annotations

import tomllib
import tracemalloc
from functools import partial

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fem_needle.errors import SceneError
from fem_needle.scene import Scene
from fem_needle.scene_file import load_scene, parse_scene
from tests.fuzz.kinds import KINDS, check, corpus
from tests.fuzz.target import broken, changed, fuzz
from tests.unit.scene.examples import entry_data, scene_data

INPUTS = [(kind, path) for kind in KINDS for path in corpus(kind)]
QUICK = partial(settings, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize(("kind", "path"), INPUTS, ids=lambda value: getattr(value, "name", value))
def test_the_corpus(kind, path):
    check(kind, path.read_bytes())


def test_every_kind_has_a_corpus_and_the_target_finds_what_breaks(monkeypatch, tmp_path):
    assert {kind for kind, _ in INPUTS} == set(KINDS)

    def fragile(content):
        raise ZeroDivisionError("fragile")

    monkeypatch.setitem(KINDS, "scene", fragile)
    monkeypatch.setattr("tests.fuzz.target.CORPUS", tmp_path)
    (tmp_path / "scene").mkdir()
    assert broken("scene", b"").startswith("ZeroDivisionError: fragile")
    assert len(fuzz("scene", 0.05, 0)) == 1
    assert len(list((tmp_path / "scene").iterdir())) == 1


def test_the_same_seed_makes_the_same_inputs():
    import random

    known = [path.read_bytes() for path in corpus("scene")]
    first, second = ([changed(known[0], known, chance) for _ in range(20)] for chance in (random.Random(1), random.Random(1)))
    assert first == second != [known[0]] * 20


leaves = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["1 mm", "1e400 m", "-3 N", "1 mm^9", "nan m", "auto", "rigid", "speed.csv", "1 m/s/s", "", "²", "1²"]),
    st.dates(),
    st.times(),
)
keys = st.one_of(
    st.sampled_from(["time", "value", "unit", "mean", "amplitude", "frequency", "file", "column", "kind", "name", "force"]),
    st.text(max_size=5),
)
values = st.recursive(leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4), max_leaves=8)


def paths(data, before=()):
    """Yield the way to every value of plain data."""
    yield before
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, item in items:
        yield from paths(item, (*before, key))


def replaced(data, path, value):
    if not path:
        return value
    copy = data.copy()
    copy[path[0]] = replaced(copy[path[0]], path[1:], value)
    return copy


@st.composite
def broken_scenes(draw):
    """Draw a scene with one or two values or keys that nobody would write."""
    data = draw(scene_data() | st.just(entry_data()))
    for _ in range(draw(st.integers(1, 2))):
        path = draw(st.sampled_from([path for path in paths(data) if path]))
        data = replaced(data, path, draw(values))
        if draw(st.booleans()):
            data = data | {draw(st.sampled_from([*Scene.model_fields]) | keys): draw(values)}
    return data


@given(broken_scenes())
@QUICK(max_examples=60)
def test_plain_data_loads_or_is_refused(data):
    try:
        scene = Scene.from_dict(data)
    except SceneError as error:
        assert all(error.mistakes)
    else:
        assert Scene.from_dict(scene.to_dict(complete=True)) == scene


@given(broken_scenes())
@QUICK(max_examples=20)
def test_what_is_written_loads_or_is_refused(data):
    try:
        text = tomli_w.dumps(data)
        tomllib.loads(text)
    except Exception:  # no TOML has such values
        return
    check("scene", text.encode("utf-8", "replace"))


known = st.sampled_from([*Scene.model_fields, "layers", "0", "phantom", "force", "length", "²", "-1", "9", ""])
dotted = st.lists(known | keys, max_size=4)


@given(dotted.map(".".join), values)
@QUICK(max_examples=60)
def test_any_path_and_value(path, value):
    scene = load_scene("thesis")
    try:
        scene.with_value(path, value)
    except SceneError as error:
        assert all(error.mistakes)


@given(st.lists(st.text(max_size=12) | st.sampled_from(["--set", "--elements", "thesis", "--mesh", "--json", "-h"]), max_size=5))
@QUICK(max_examples=15)
def test_any_command_line(arguments):
    check("command", "\n".join(["run", *arguments]).encode("utf-8", "replace"))


cells = st.text(max_size=6) | st.floats().map(str) | st.sampled_from(["time [s]", "speed [mm/s]", '"a', "1", "2"])


@given(st.lists(st.lists(cells, max_size=4).map(",".join), max_size=6))
@QUICK(max_examples=60)
def test_any_table(lines):
    check("csv", "\n".join(lines).encode("utf-8", "replace"))


PLAIN = """
needle = { length = 0.2, bending_stiffness = 0.02, mass_per_length = 0.01 }
support = { kind = "entry" }
insertion = { kind = "hold", initial_depth = 0.1 }
run = { duration = 1.0 }
"""
DEEP = {
    "a dotted key": "title" + ".a" * 100_000 + " = 1",
    "dotted headers": "\n".join(f"[{'a.' * number}b]" for number in range(300)),
    "dotted keys in quotes": "title" + ".'a,'" * 20_000 + " = 1",
    "many dotted keys": "\n".join(f"a{number}" + ".b" * 14 + "=1" for number in range(500)),
    "many lists": "[[a]]\n" * 200_000,
    "many layers": PLAIN + "tissue.layers = [" + "{foundation_modulus=1.0}," * 3_000 + "]",
    "many loads": PLAIN + "tissue = {}\nloads = [" + "{kind='tip',force=1.0}," * 3_000 + "]",
    "tables in tables": "title = " + "{a = " * 400 + "1" + "}" * 400,
    "lists in lists": "title = " + "[" * 400 + "]" * 400,
    "one long number": "[needle]\nlength = " + "9" * 4000,
    "one long text": "title = '" + "a" * 1_000_000 + "'",
    "many keys": "\n".join(f"k{number} = 1" for number in range(3_000)),
    "many mistakes": "[tissue]\n" + "[[tissue.layers]]\nfoo = 1\n" * 2000,
    "a long list": "[numerics]\nmesh = [" + "0," * 10_000 + "]",
}


@pytest.mark.parametrize("name", DEEP)
def test_what_is_deep_or_long_is_refused_with_little_memory(name):
    tracemalloc.start()
    try:
        check("scene", DEEP[name].encode())
        with pytest.raises(SceneError) as caught:
            parse_scene(DEEP[name])
        assert len(str(caught.value)) < 20_000
        assert tracemalloc.get_traced_memory()[1] < 200_000_000
    finally:
        tracemalloc.stop()
