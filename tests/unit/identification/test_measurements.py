"""The user's CSV: units, names, and what is refused."""

import numpy as np
import pytest

from fem_needle import SceneError, load_scene, run_scene
from fem_needle.csv_file import series_csv
from fem_needle.identification import read_measurements, sampling_interval

GOOD = "time [s],depth [mm],tip_deflection [mm],push_force [N]\n0,20,0.1,0.5\n0.5,25,0.2,0.6\n1,30,0.4,0.7\n"


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "data.csv"
        path.write_bytes(text.encode("utf-8"))
        return path

    return write


def test_columns_are_in_si(written):
    found = read_measurements(written(GOOD), {"push_force": "N"})
    assert found.names == ("time", "depth", "tip_deflection", "push_force")
    assert found["depth"] == pytest.approx([0.02, 0.025, 0.03])
    assert found["tip_deflection"][1] == 0.0002
    assert found.size == 3
    assert "push_force" in found
    assert "speed" not in found
    assert found.rows(found["time"] > 0.0)["push_force"] == pytest.approx([0.6, 0.7])


def test_spaces_blank_lines_and_a_byte_order_mark(written):
    text = "\ufeff" + GOOD.replace(",", " , ").replace("\n0.5", "\r\n\r\n0.5")
    assert read_measurements(written(text))["push_force"] == pytest.approx([0.5, 0.6, 0.7])


def test_own_columns_take_any_unit(written):
    found = read_measurements(written("force_x [mN],count [1],turn [deg]\n1,2,180\n3,4,90\n"))
    assert found["force_x"] == pytest.approx([1e-3, 3e-3])
    assert found["turn"] == pytest.approx([np.pi, np.pi / 2])


def test_an_exported_run_is_read_back(tmp_path):
    run = run_scene(load_scene("thesis").with_values({"insertion.final_depth": 0.03, "numerics.output_step": 0.5}), elements=4)
    path = tmp_path / "series.csv"
    path.write_bytes(series_csv(run))
    found = read_measurements(path)
    for name in ("time", "depth", "tip_deflection", "push_force"):
        assert np.array_equal(found[name], getattr(run, name)), name


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace("depth [mm]", "depth"), r"'depth' needs its unit in brackets, as in 'depth \[m\]'"),
        (GOOD.replace("depth [mm]", "depth []"), "needs its unit"),
        (GOOD.replace("depth [mm]", "depth [N]"), "'depth' is in 'N' .allowed length, such as m"),
        (GOOD.replace("depth [mm]", "depth [furlong]"), "unknown unit 'furlong'"),
        (GOOD.replace("depth [mm]", "time [s]"), "'time' comes twice"),
        (GOOD.replace("depth [mm]", "[mm]"), "has no name"),
        (GOOD.replace("push_force", "force"), r"needs a column 'push_force' \[N\]"),
        (GOOD.replace("0.2,", "soft,"), "row 3 column 3 .'tip_deflection'. is not a number .got 'soft'"),
        (GOOD.replace("0.2,", "nan,"), "row 3 column 3 .'tip_deflection'. is not finite"),
        (GOOD.replace("0.2,", "1e300,"), "is not finite"),
        (GOOD.replace(",0.6", ""), "row 3 column 4 .'push_force'. is missing"),
        (GOOD.replace(",0.6", ",0.6,0.7"), "row 3 column 5 has more cells"),
        (GOOD.replace("0.5,25", "1.5,25"), "times must rise .row 4"),
        (GOOD.splitlines()[0], "needs a header and at least 2 rows .got 0"),
        (",".join(f"a{n} [m]" for n in range(1001)) + 2 * ("\n0" + 1000 * ",0"), "1001 columns"),
        (GOOD + '"', "is no CSV|is missing"),
        ("\0", "is not text"),
        ("", "is empty"),
    ],
)
def test_mistakes(written, text, message):
    with pytest.raises(SceneError, match=message):
        read_measurements(written(text), {"push_force": "N"})


def test_all_mistakes_of_a_header_at_once(written):
    with pytest.raises(SceneError) as told:
        read_measurements(written("time [m],depth,tip [mm]\n0,0,0\n1,1,1\n"), {"push_force": "N"})
    assert len(told.value.mistakes) == 3


def test_no_such_file_or_column(written, tmp_path):
    with pytest.raises(SceneError, match=r"'other.csv' does not exist"):
        read_measurements(tmp_path / "other.csv")
    with pytest.raises(SceneError, match="has no column 'speed'"):
        read_measurements(written(GOOD))["speed"]


def test_the_sampling_interval():
    assert sampling_interval(np.round(np.arange(100) / 30, 3)) == pytest.approx(1 / 30)
    for times in ([0.0, 0.1, 0.3], [0.0], [0.2, 0.1, 0.0]):
        with pytest.raises(SceneError, match="time: "):
            sampling_interval(np.array(times))
