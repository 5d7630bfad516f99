"""What needs more memory than there is, is refused first."""

import pytest

from gmwm import InputError
from gmwm._core import memory


def test_half_of_what_there_is_may_be_used(monkeypatch):
    monkeypatch.delenv(memory.VARIABLE, raising=False)
    assert 1 << 24 < memory.budget() < 1 << 50


def test_the_user_may_say_how_much(monkeypatch):
    monkeypatch.setenv(memory.VARIABLE, "0.5")
    assert memory.budget() == 1 << 29
    memory.require(1 << 29, "a.csv")
    with pytest.raises(InputError, match=r"a.csv needs about 2 GB of memory, and 0.5 GB") as caught:
        memory.require(1 << 31, "a.csv")
    assert caught.value.code == "memory"


@pytest.mark.parametrize("text", ["", "much", "0", "-1", "nan", "inf", "1e12"])
def test_what_is_no_amount(monkeypatch, text):
    monkeypatch.setenv(memory.VARIABLE, text)
    with pytest.raises(InputError, match=r"GMWM_MEMORY = .*: give a positive number of gigabytes"):
        memory.budget()


def test_the_limit_of_a_container_counts(monkeypatch, tmp_path):
    monkeypatch.delenv(memory.VARIABLE, raising=False)
    monkeypatch.setattr(memory, "_CGROUP", tmp_path)
    (tmp_path / "memory.max").write_text("max\n")
    free = memory.budget()
    (tmp_path / "memory.max").write_text(f"{1 << 20}\n")
    assert memory.budget() == 1 << 19 < free
