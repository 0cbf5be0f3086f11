"""One reader of CSV: what is read as it was meant, what is refused with row, column and advice; in scenes and as measurements."""

import codecs
import re

import pytest

from fem_needle.errors import SceneError
from fem_needle.identification.measurements import read_measurements
from fem_needle.scene.csv_table import LARGEST_NUMBER, read_csv
from fem_needle.scene.table_file import read_table

HEADER = "time [s],depth [mm]"
PLAIN = f"{HEADER}\n0,20.5\n1,30.25\n"
DEPTHS = [0.0205, 0.03025]
SEMICOLONS = "time [s];depth [mm]\n0,0;20,5\n1,0;30,25\n"


def as_scene(path):
    found = read_table(path.name, "depth", path.parent)
    return found["time"], [1e-3 * value for value in found["value"]]


def as_measurements(path):
    found = read_measurements(path)
    return found["time"].tolist(), found["depth"].tolist()


@pytest.fixture(params=[as_scene, as_measurements], ids=lambda reader: reader.__name__)
def reader(request, tmp_path):
    def read(content):
        path = tmp_path / "data.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return request.param(path)

    return read


MEANT = {
    "plain": PLAIN,
    "spaces": PLAIN.replace(",", " , "),
    "quoted": PLAIN.replace("time [s]", '"time [s]"').replace("20.5", ' "20.5"'),
    "quoted decimal commas": PLAIN.replace("20.5", '"20,5"').replace("30.25", '"30,25"'),
    "semicolons and decimal commas": SEMICOLONS,
    "semicolons and points": PLAIN.replace(",", ";"),
    "tabs": PLAIN.replace(",", "\t"),
    "tabs and decimal commas": SEMICOLONS.replace(";", "\t"),
    "commas with three digits, others tell": SEMICOLONS.replace("20,5", "20,500"),
    "ends of lines of Windows and of old": PLAIN.replace("\n", "\r\n", 1).replace("\n1", "\r1"),
    "blank lines": "\n \n" + PLAIN.replace("\n1", "\n\n1") + "\n\n",
    "byte order mark": "\ufeff" + PLAIN,
    "UTF-16, small end first": codecs.BOM_UTF16_LE + PLAIN.encode("utf-16-le"),
    "UTF-16, big end first": codecs.BOM_UTF16_BE + PLAIN.encode("utf-16-be"),
    "header behind a number sign": "# " + PLAIN,
    "header behind a percent sign": "%" + PLAIN,
    "header behind a semicolon": "; " + PLAIN,
    "comments above": "# measured in gel; 20 C\n#\n" + PLAIN,
    "comments, then a header behind a sign": "# measured in gel\n# " + PLAIN,
    "line of a spreadsheet": "sep=;\n" + SEMICOLONS,
}


@pytest.mark.parametrize("name", MEANT)
def test_what_is_meant_is_read(reader, name):
    times, depths = reader(MEANT[name])
    assert times == [0.0, 1.0]
    assert depths == pytest.approx(DEPTHS, rel=1e-12)


REFUSED = {
    "long row": (PLAIN + "2,40,7\n", "row 4 column 3 has more cells than the header: the row has 3 cells, the header 2"),
    "long row of empty cells": (PLAIN + "2,40,\n", "row 4 column 3 has more cells"),
    "decimal commas between commas": (f"{HEADER}\n0,0,20,5\n1,0,30,25\n", "row 2 column 3.*decimal commas are read where"),
    "short row": (PLAIN + "2\n", r"row 4 column 2 \('depth'\) is missing: the row has 1 cell, the header 2"),
    "blank lines count": ("\n" + PLAIN + "\n\n2,soft\n", r"row 7 column 2 \('depth'\) is not a number \(got 'soft'\)"),
    "blank lines count, times": (PLAIN + "\n\n1,40\n", r"times must rise \(row 6 does not: got 1 s after 1 s\)"),
    "header and rows differ": (PLAIN.replace(",", ";", 1), "row 2 column 2.* is missing.*separate rows and header alike.*commas"),
    "rows and header differ": (f"{HEADER}\n0;20\n1;30\n", "row 2 column 2.*separate rows and header alike.*semicolons"),
    "underscore": (PLAIN + "2,1_000\n", "row 4 column 2 .* is not a number .got '1_000'.: write digits without underscores"),
    "thousands": (PLAIN + '2,"1,234.5"\n', "row 4 column 2.*without separated thousands"),
    "point and comma": ("time [s];depth [mm]\n0.5;20,5\n1.5;30,2\n", "row 2 column 2.*write all numbers with points"),
    "comma of either kind": ("time [s];depth [mm]\n0;1,250\n1;2,500\n", "row 2 column 2.*a decimal comma or separate thousands"),
    "empty cell": (PLAIN + "2,\n", "row 4 column 2.* is empty"),
    "not finite": (PLAIN + "2,nan\n", "row 4 column 2.* is not finite .got 'nan'.: allowed up to 1e"),
    "infinite": (PLAIN + "inf,40\n", "row 4 column 1.* is not finite"),
    "huge": (PLAIN + f"2,{10 * LARGEST_NUMBER}\n", "row 4 column 2.* is not finite"),
    "other digits": (PLAIN + "2,\u0661\n", "row 4 column 2.* is not a number"),
    "row of units": (PLAIN.replace("\n", "\ns,mm\n", 1), "row 2 column 1.*a unit belongs into the header"),
    "comment between rows": (PLAIN + "# pause\n2,40\n", "row 4 is a comment.*above the header"),
    "no header": ("0,20\n1,30\n", "row 1 is no header .got '0,20'.; name the columns"),
    "only a header": ("# " + HEADER + "\n", "got none"),
    "name without a unit's brackets": (PLAIN.replace("time [s]", "time (s)"), "time"),
    "column twice": ("time [s],depth [mm],depth [mm]\n0,1,1\n1,2,2\n", "'depth' comes twice"),
    "column without a name": (PLAIN.replace("\n", ",\n"), "column 3 has no name"),
    "spaces as separators": ("time [s]\n0 20\n1 30\n", "column"),
    "open quotation": (PLAIN + '2,"40\n', "row 4 is no CSV"),
    "UTF-16 without its mark": (PLAIN.encode("utf-16-le"), "save it as text in UTF-8"),
    "other encoding": (PLAIN.replace("depth", "d\u00e9pth").encode("latin-1"), "save it as UTF-8"),
    "nothing": ("\n\n", "is empty"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_its_place(reader, name):
    content, message = REFUSED[name]
    with pytest.raises(ValueError) as caught:
        reader(content)
    assert re.search(message, str(caught.value)), str(caught.value)
    assert "data.csv" in str(caught.value)


def test_cells_that_nobody_reads_may_hold_words():
    table = read_csv("time [s];depth [mm];note\n0,5;20;wet, cold\n1,5;21;dry\n")
    assert table.numbers(0) == [0.5, 1.5]
    with pytest.raises(ValueError, match=r"row 2 column 3 .'note'. is not a number"):
        table.numbers(2)


def test_names_with_spaces_and_capitals_are_understood(reader):
    assert reader(PLAIN.replace("time", "Time").replace("depth", "Depth"))[1] == pytest.approx(DEPTHS)


def test_a_near_name_is_told(tmp_path):
    (tmp_path / "data.csv").write_text(PLAIN.replace("time [s]", "Time (s)"))
    with pytest.raises(ValueError, match=r"did you mean 'time' by 'Time \(s\)'\? A unit is in square brackets"):
        read_table("data.csv", "depth", tmp_path)
    with pytest.raises(SceneError, match="did you mean 'push_force' by 'push_forces'"):
        (tmp_path / "data.csv").write_text("push_forces [N]\n0\n1\n")
        read_measurements(tmp_path / "data.csv", {"push_force": "N"})
