"""The list of messages finds what it should; whether all are met is asked after a measured run of all tests (`.ci/long`)."""

import ast

from coverage import CoverageData

from tests.house.messages import executed, messages, tells, unmet
from tests.house.source import ROOT


def test_errors_and_warnings_are_messages_and_nothing_else_is():
    lines = ["raise SceneError('a')", "raise", "raise errors.ComputationError('b') from error", "warnings.warn('c')", "tell('d')"]
    assert [tells(ast.parse(line).body[0]) for line in lines] == [True, False, True, True, False]


def test_both_packages_have_messages():
    found = messages()
    assert {message.path.relative_to(ROOT).parts[0] for message in found} == {"fem_needle", "reduced_model"}
    assert all("(" in message.text and message.first <= message.last for message in found)


def test_a_message_is_met_when_one_of_its_lines_was_executed(tmp_path):
    found = messages()
    first = found[0].path
    lines = {message.last for message in found if message.path == first}
    data = CoverageData(str(tmp_path / "measured"))
    data.add_lines({str(first): lines})
    assert {message.path for message in unmet(data)} == {message.path for message in found} - {first}
    assert executed(data) == {str(first.relative_to(ROOT)): lines}
