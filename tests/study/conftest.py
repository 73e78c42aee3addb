"""Worker processes are kept between the tests of studies."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

CURRENT_TEST = "PYTEST_CURRENT_TEST"


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup() -> Iterator[None]:
    """As below, for fixtures that run a study."""
    os.environ.pop(CURRENT_TEST, None)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call() -> Iterator[None]:
    """Without what differs between tests: workers of another environment are not used again."""
    os.environ.pop(CURRENT_TEST, None)
    return (yield)
