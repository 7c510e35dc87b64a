"""Comparisons of strategies."""

import numpy as np
import pytest

import domelight as dl

SMALL = dict(size=(24, 24), seeds=2, reference_spp=64)


@pytest.mark.filterwarnings("ignore::domelight.DomelightWarning")
def test_strategies_are_compared(sphere, env):
    found = dl.compare(
        sphere, env, {"mis": "mis:1:1", "mine": dl.strategies.Environment(env, 2)}, budget="spp:4", **SMALL
    )
    assert found.report["budget"] == "spp:4"
    assert [s["name"] for s in found.report["strategies"]] == ["mis", "mine"]
    results = [s["result"] for s in found.report["strategies"]]
    assert all(r["spp"] == 4 and r["rel_mse"]["mean"] > 0 for r in results)
    for arrays, shape in [(found.pictures, (24, 24, 3)), (found.errors, (24, 24)), (found.flip, (24, 24))]:
        assert list(arrays) == ["mis", "mine"]
        assert all(a.shape == shape and a.dtype == np.float32 for a in arrays.values())
    assert found.reference.shape == (24, 24, 3)
    own = dl.metrics.relative_error_map(found.pictures["mine"], found.reference)
    assert np.allclose(found.errors["mine"], own)
    assert "mine" in str(found) and found.page.lstrip().lower().startswith("<!doctype html")
    assert found._repr_html_().startswith("<iframe")


@pytest.mark.filterwarnings("ignore::domelight.DomelightWarning")
def test_what_is_raised_comes_back(sphere, env, tmp_path):
    def broken(points):
        raise LookupError("my own")

    with pytest.raises(LookupError, match="my own"):
        dl.compare(sphere, env, ["mis", broken], budget="spp:2", **SMALL)
    found = dl.compare(sphere, env, ["mis"], budget="spp:2", **SMALL)
    found.save(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == found.page


@pytest.mark.filterwarnings("ignore::domelight.DomelightWarning")
def test_progress_is_reported(sphere, env, capfd):
    seen = []
    report = lambda share, label: seen.append((share, label))
    dl.compare(sphere, env, ["mis"], budget="spp:512", progress=report, **SMALL)
    assert any("mis" in label for _, label in seen), seen
    shares = [share for share, _ in seen]
    assert shares == sorted(shares) and 0 < shares[-1] <= 1
    pytest.importorskip("tqdm")
    dl.compare(sphere, env, ["mis"], budget="spp:512", progress=True, **SMALL)
    assert "mis" in capfd.readouterr().err


@pytest.mark.parametrize(
    "wrong, words",
    [
        (dict(strategies=[]), "no strategy"),
        (dict(strategies=["mis", "mis"]), "twice"),
        (dict(strategies=["velvet"]), "velvet"),
        (dict(budget="velvet"), "velvet"),
        (dict(seeds=0), "seeds is 0"),
        (dict(reference_spp=0), "reference_spp is 0"),
    ],
)
def test_wrong_wishes_are_named(sphere, env, wrong, words):
    with pytest.raises(ValueError, match=words):
        dl.compare(sphere, env, **{"strategies": ["mis"], **SMALL, **wrong})


def test_a_comparison_is_one_line(sphere, env):
    few = dict(budget="spp:1", seeds=1, reference_spp=4, size=(8, 8))
    found = dl.compare(sphere, env, ["mis", "brdf"], **few)
    assert repr(found) == "<Comparison 8 x 8: mis, brdf>"
