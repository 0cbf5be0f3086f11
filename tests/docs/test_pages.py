"""Every code block of README and docs/ runs, in the order of its page, in a folder of its own, and prints what the page says."""

import doctest
import re
import shlex
import tomllib
from pathlib import Path

import h5py
import pytest
import scipy.io
import tomli_w
import typer

from fem_needle import load_scene
from fem_needle.cli import build_application
from tests.docs.blocks import LANGUAGES, PAGES, blocks, chosen
from tests.house.source import ROOT

SETTING_UP = (
    "python3 -m venv .venv",
    ".venv/bin/pip install -q -e .",
    ".venv/bin/pip install -q -e '.[dev]'",
    ".venv/bin/pytest",
    ". .venv/bin/activate",
)
COMMAND = re.compile(r"(?:OPENBLAS_NUM_THREADS=1 )?(?:\.venv/bin/)?fem-needle (?P<arguments>.*)")
SCRIPT = re.compile(r"python (?P<script>[\w/]+\.py)")
FENCE = re.compile(r"^\s*```", flags=re.MULTILINE)
CODE = re.compile(r"^ {4,}(fem-needle |from \w+ import|import |\w+ = \w+\(.*\)$)", flags=re.MULTILINE)
LOADED = re.compile(r"(?P<variable>\w+) = load\('(?P<file>[^']+)'\)")
READ = re.compile(r"(?:ncread|ncreadatt)\('(?P<file>[^']+)', '(?P<name>\w+)'")
MATCHER = doctest.OutputChecker()
SAME = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def name_of(path):
    return str(path.relative_to(ROOT))


QUICK = [path for path in PAGES if any(block.language not in ("text", "{toctree}") for block in chosen(path, slow=False))]
LONG = ("my-controller", "matlab")  # take some seconds each
SLOW = [path for path in PAGES if any(block.is_slow for block in blocks(path))]


class Reader:
    """Somebody who types what a page shows, in a folder of their own."""

    def __init__(self, folder, command_line, capsys):
        self.folder, self.command_line, self.capsys = folder, command_line, capsys
        self.names = {"__name__": "__main__"}
        self.printed = ""

    def follow(self, block):
        getattr(self, block.language.strip("{}"))(block)

    def sh(self, block):
        self.printed = ""
        for command in (part.strip() for line in block.lines for part in line.split("&&")):
            self._type(command, only_parsed=block.is_only_parsed)

    def _type(self, command, *, only_parsed):
        if command in SETTING_UP:
            return
        if script := SCRIPT.fullmatch(command):
            assert only_parsed and (ROOT / script["script"]).is_file(), command
            return
        match = COMMAND.fullmatch(command)
        assert match, f"not a command that can be tested: {command}"
        arguments = shlex.split(match["arguments"])
        if only_parsed:
            parsed(arguments)
            return
        status, out, err = self.command_line(*arguments)
        assert (status, "Traceback" in err) == (0, False), f"{command}\n{err}"
        assert out, command
        self.printed += out

    def python(self, block):
        exec(compile(block.text, "page", "exec"), self.names)
        self.printed = self.capsys.readouterr().out

    def output(self, block):
        wanted = block.text
        assert MATCHER.check_output(wanted, self.printed, SAME), f"the page says\n{wanted}\nprinted was\n{self.printed}"

    def toml(self, block):
        head = re.match(r"# (into )?([\w-]+\.toml)\n", block.text)
        assert head, f"a scene needs the name of its file in its first line: {block.text}"
        path, data = self.folder / head[2], tomllib.loads(block.text)
        if head[1]:
            path.write_text(tomli_w.dumps(tomllib.loads(path.read_text(encoding="utf-8")) | data), encoding="utf-8")
        else:
            path.write_text(block.text, encoding="utf-8")
        load_scene(path)

    def csv(self, block):
        assert re.fullmatch(r"[\w-]+\.csv", block.name)
        (self.folder / block.name).write_text(block.text, encoding="utf-8")

    def matlab(self, block):
        loaded = {match["variable"]: match["file"] for match in LOADED.finditer(block.text)}
        read = [(match["file"], match["name"]) for match in READ.finditer(block.text)]
        assert loaded or read, "a block that reads no file of the program"
        for variable, file in loaded.items():
            fields = set(re.findall(rf"\b{variable}\.(\w+)", block.text))
            assert fields <= set(scipy.io.loadmat(self._file(file))), f"{file}: {fields}"
        for file, name in read:
            with h5py.File(self._file(file)) as content:
                assert name in content, f"{file}: {name}"

    def _file(self, name) -> Path:
        return self.folder / name

    def text(self, block):
        """No code."""

    toctree = text


def parsed(arguments):
    """Parse a command line as the program does, without doing anything."""
    application = typer.main.get_command(build_application())
    context = application.make_context("fem-needle", list(arguments))
    name, command, rest = application.resolve_command(context, list(arguments))
    command.make_context(name, list(rest), parent=context)


@pytest.fixture
def reader(tmp_path, monkeypatch, command_line, capsys):
    monkeypatch.chdir(tmp_path)
    return Reader(tmp_path, command_line, capsys)


@pytest.mark.parametrize(
    "page", [pytest.param(page, id=name_of(page), marks=[pytest.mark.slow] * (page.stem in LONG)) for page in QUICK]
)
def test_what_a_page_shows_runs(page, reader):
    for block in chosen(page, slow=False):
        reader.follow(block)


@pytest.mark.slow
@pytest.mark.parametrize("page", SLOW, ids=name_of)
def test_everything_that_a_page_shows_runs(page, reader):
    for block in chosen(page, slow=True):
        reader.follow(block)


def test_every_block_has_a_language_and_every_code_is_a_block():
    for page in PAGES:
        text, found = page.read_text(encoding="utf-8"), blocks(page)
        assert len(FENCE.findall(text)) == 2 * len(found), f"{name_of(page)}: a block is indented or not closed"
        assert {block.language for block in found} <= LANGUAGES, name_of(page)
        outside = text
        for block in found:
            outside = outside.replace(block.text, "")
        assert CODE.findall(outside) == [], name_of(page)


def test_few_commands_are_only_parsed():
    assert {name_of(page) for page in PAGES for block in blocks(page) if block.is_only_parsed} <= {"docs/benchmark.md"}


def test_what_cannot_be_found_out_is_refused(reader):
    """The tests of the pages can fail."""
    page = "<!-- slow -->\n```sh\nfem-needle run nowhere\n```\n\n```output\nx ... y\n```\n"
    path = reader.folder / "page.md"
    path.write_text(page, encoding="utf-8")
    command, output = blocks(path)
    assert (command.is_slow, chosen(path, slow=False)) == (True, [])
    reader.printed = "x 1\n  2 z\n"
    for block in (command, output):
        with pytest.raises(AssertionError):
            reader.follow(block)
