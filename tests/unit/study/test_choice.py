"""How often the true model is chosen."""

from gmwm.study import studies as choice


def test_the_study_counts_right_choices_and_surplus_terms(monkeypatch):
    monkeypatch.setattr(choice, "TRUTHS", choice.TRUTHS[:3])
    found = choice.choice_study(1, 0, 1, lengths=(4_000,))
    assert [item.truth for item in found] == list(choice.TRUTHS)
    white = found[0]
    assert (white.right, white.runs, sum(white.surplus.values())) == (1, 1, 1)
    table = choice.choice_table(found)
    rows = [line.split(maxsplit=5) for line in table.splitlines()]
    assert ["4,000", "100%", "0%", "0%", "0%", "white noise"] in rows
    assert len(table.splitlines()) == len(choice.TRUTHS) + 5
