"""Conversion of columns to pandas, polars and pyarrow."""

import numpy as np
import pytest

import flexarm


def test_arrow_pandas_and_polars_have_the_same_numbers(run: flexarm.Run) -> None:
    pa, pl = pytest.importorskip("pyarrow"), pytest.importorskip("polars")
    table = run.table()
    arrow, pandas, polars = run.to_arrow(), run.to_pandas(), run.to_polars()
    assert isinstance(arrow, pa.Table) and isinstance(polars, pl.DataFrame)
    assert arrow.column_names == polars.columns == list(table) == [pandas.index.name, *pandas.columns]
    for name, column in table.items():
        assert np.array_equal(arrow[name].to_numpy(), column)
        assert np.array_equal(polars[name].to_numpy(), column)
    assert np.array_equal(pandas["error_z_m"], run.error[:, 2])
    assert pandas.index[-1] == run.time[-1]


def test_arrow_is_taken_without_a_copy(run: flexarm.Run) -> None:
    pa = pytest.importorskip("pyarrow")
    reader = pa.RecordBatchReader.from_stream(run)
    batch = reader.read_next_batch()
    assert batch.num_rows == len(run)
    column = batch.column(0)
    assert column.to_numpy(zero_copy_only=True).base is not None


def test_runs_and_responses_are_drawn(run: flexarm.Run, arm: flexarm.Arm, tmp_path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    ax = run.plot()
    assert [line.get_label() for line in ax.lines] == ["TCP error", "static", "dynamic"]
    assert ax.lines[0].get_ydata().max() == pytest.approx(1e3 * run.summary["tcp"]["peak_m"], rel=1e-3)
    again = run.plot(ax, parts=False)
    assert again is ax and len(ax.lines) == 4
    ax.figure.savefig(tmp_path / "run.png")
    response = arm.response([0, -1.2, 1.5, 0, 0.4, 0], outputs=["z"], points=50)
    assert len(response.plot().lines) == 3


def test_notebooks_are_shown_tables(run: flexarm.Run, arm: flexarm.Arm) -> None:
    for shown in [run._repr_html_(), arm._repr_html_(), arm.robot._repr_html_()]:
        assert shown.startswith("<table>") and "KR" in shown.upper()
    assert f"{1e3 * run.summary['tcp']['peak_m']:.4f} mm" in run._repr_html_()
    assert "kr210" in repr(run) and "kr210" in repr(arm)


def test_a_run_without_a_recording_cannot_be_shown(run: flexarm.Run) -> None:
    with pytest.raises(ValueError, match="output="):
        run.show()
