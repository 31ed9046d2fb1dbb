import pytest
from hypothesis import settings
from numba import get_num_threads, set_num_threads

# The same examples every time, however busy the machine is.
settings.register_profile("core", deadline=None, derandomize=True)
settings.load_profile("core")


@pytest.fixture(autouse=True)
def one_thread():
    """Threads that wait for each other are slow on small problems; who wants more says so."""
    before = get_num_threads()
    set_num_threads(1)
    yield
    set_num_threads(before)
