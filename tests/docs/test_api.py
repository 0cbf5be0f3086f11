"""The pages on Python list everything that the contract names, with all parameters; the site is built without a warning."""

import inspect
import re
import sys
from importlib import import_module
from subprocess import run

import pytest

import fem_needle
import reduced_model
from tests.house.source import ROOT

DOCS = ROOT / "docs"
CONTRACT = (DOCS / "contract.md").read_text(encoding="utf-8").partition("## Python")[2]
ENTRY = re.compile(r"^\.\. (?:currentmodule:: (?P<module>[\w.]+)|auto(?P<kind>\w+):: (?P<name>\w+))$", flags=re.MULTILINE)
BLOCK = re.compile(r"^```text\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
LINK = re.compile(r'href="(?P<path>[^"#:]*)(?:#(?P<place>[^"]*))?"')


def listed():
    """What the pages list: (module, name) and the thing itself."""
    found = {}
    for page in sorted((DOCS / "api").glob("*.rst")):
        module = ""
        for match in ENTRY.finditer(page.read_text(encoding="utf-8")):
            if match["module"]:
                module = match["module"]
            else:
                found[module, match["name"]] = getattr(import_module(module), match["name"])
    return found


def test_everything_public_is_listed():
    names = {("fem_needle", name) for name in dir(fem_needle)} | {("reduced_model", name) for name in dir(reduced_model)}
    assert names - set(listed()) == set()


def test_everything_that_the_contract_calls_is_listed():
    signatures = "".join(BLOCK.findall(CONTRACT))
    names = set(re.findall(r"(?:^| {3,})(\w+)\(", signatures, flags=re.MULTILINE))
    for quoted in re.findall(r"`([^`\n]+)`", BLOCK.sub("", CONTRACT)):
        names |= {match[0] or match[1] for match in re.findall(r"^(?:(\w+)\(.*|([A-Z]\w+))$", quoted)}
    assert {"run_scene", "identify_friction", "AssumedModeNeedle", "Layer", "read_folder"} <= names
    assert names - {name for _, name in listed()} - NOT_LISTED == set()


PARTS = {"Plant", "ConvergenceRow", "Repetition"}  # what the contract names by what they hold
# Results of commands, of which only the texts are public; Python's own; methods of ModelFamily.
NOT_LISTED = {"Benchmark", "StressTable", "ValueError", "pilot", "build", "choose"}


def test_nothing_is_listed_that_the_contract_does_not_name():
    assert {name for _, name in listed() if not re.search(rf"\b{name}\b", CONTRACT)} - PARTS == set()


def test_every_parameter_is_explained():
    missing = {}
    for (module, name), thing in listed().items():
        if inspect.isfunction(thing):
            text = inspect.getdoc(thing) or ""
            unknown = [parameter for parameter in inspect.signature(thing).parameters if not re.search(rf"\b{parameter}\b", text)]
            if unknown:
                missing[f"{module}.{name}"] = unknown
    assert missing == {}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(DOCS), str(folder)]
    done = run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


@pytest.mark.slow
def test_links_of_the_site_lead_somewhere(site):
    pages = {path: path.read_text(encoding="utf-8") for path in site.rglob("*.html")}
    assert len(pages) > 40
    dead = []
    for page, text in pages.items():
        for match in LINK.finditer(text):
            target = (page.parent / match["path"].partition("?")[0]).resolve() if match["path"] else page
            place = match["place"]
            if not target.exists() or (place and target in pages and f'id="{place}"' not in pages[target]):
                dead.append((page.name, match[0]))
    assert dead == []


@pytest.mark.slow
def test_the_site_needs_no_network(site):
    loaded = re.compile(r'<(?:script|img|iframe)[^>]*src="https?:|<link[^>]*stylesheet[^>]*href="https?:|@import url\(.?https?:')
    assert [page.name for page in site.rglob("*.html") if loaded.search(page.read_text(encoding="utf-8"))] == []
    assert all((site / page).is_file() for page in ("index.html", "tutorial.html", "api/runs.html", "how-to/my-needle.html"))


@pytest.mark.slow
def test_units_and_shapes_are_on_the_pages(site):
    """They come from the docstrings, whose first colon napoleon would take for a type."""
    text = re.sub(r"<[^>]+>", "", "".join(path.read_text(encoding="utf-8") for path in sorted((site / "api").glob("*.html"))))
    for shown in ("Largest step [s]", "Duration of the run [s]: as given", "(nt, n)", "[N/m^2], lateral force per length"):
        assert shown in text
