"""What tests share. They run against the installed package, never against the sources."""

import os
import pathlib
import signal

import numpy as np
import pytest

import domelight as dl

ROOT = pathlib.Path(__file__).resolve().parents[3]


def pytest_configure() -> None:
    # A shell starts what runs in its background with Ctrl-C ignored, and Python leaves it so.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_report_header() -> str:
    return f"domelight {dl.__version__} from {pathlib.Path(dl.__file__).parent}"


@pytest.fixture(scope="session")
def program() -> str:
    """The program `domelight`: that of $DOMELIGHT, or one that cargo built."""
    places = [os.environ.get("DOMELIGHT", ""), *(ROOT / f"target/{p}/domelight" for p in ("release", "debug"))]
    for place in places:
        if place and pathlib.Path(place).is_file():
            return str(place)
    if os.environ.get("CI") == "true":
        pytest.fail("there is no program to compare with: build domelight-cli or set DOMELIGHT")
    pytest.skip("there is no program to compare with")


@pytest.fixture(scope="session")
def sphere() -> dl.Scene:
    return dl.Scene.builtin("sphere")


@pytest.fixture(scope="session")
def env() -> dl.Environment:
    return dl.Environment.builtin("studio", rows=64)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)
