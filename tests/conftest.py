"""Browser tests need a Chromium: without one they are left out, loudly, or fail where REQUIRE_BROWSER=1 is set.

Property tests take the same examples in every run of `make test`, and new ones in every run of `make test-all`.
None has a deadline of wall time: a busy machine is not a defect.
"""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from tests.browser.chromium import find_chromium

settings.register_profile("same-examples", derandomize=True, database=None, deadline=None)
settings.register_profile("new-examples", print_blob=True, deadline=None)
settings.load_profile("same-examples")

REQUIRED = os.environ.get("REQUIRE_BROWSER") == "1"
ADVICE = "no Chromium was found (tried $CHROMIUM, chromium, google-chrome and playwright's own)"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    in_browser = [item for item in items if item.get_closest_marker("browser")]
    if not in_browser or find_chromium() is not None:
        return
    if REQUIRED:
        raise pytest.UsageError(f"REQUIRE_BROWSER=1 is set, but {ADVICE}")
    config.hook.pytest_deselected(items=in_browser)
    items[:] = [item for item in items if item not in in_browser]


@pytest.fixture(autouse=True, scope="session")
def _folders_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keys and flights of the tests stay away from the user's."""
    with pytest.MonkeyPatch.context() as patch:
        for variable in ("XDG_CONFIG_HOME", "XDG_STATE_HOME"):
            patch.setenv(variable, str(tmp_path_factory.mktemp(variable)))
        yield


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if find_chromium() is None and not REQUIRED:
        terminalreporter.write_sep("!", f"browser tests were LEFT OUT: {ADVICE}", red=True, bold=True)
