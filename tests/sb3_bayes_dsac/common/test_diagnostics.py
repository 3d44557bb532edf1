from __future__ import annotations

import torch as th

from sb3_bayes_dsac.common.diagnostics import Diagnostics


def test_only_the_newest_report_of_a_topic_is_computed() -> None:
    computed: list[int] = []
    diagnostics = Diagnostics()

    def report(k: int) -> dict[str, th.Tensor]:
        computed.append(k)
        return {"loss": th.tensor(float(k))}

    for k in range(3):
        diagnostics.note("critics", lambda k=k: report(k))
    diagnostics.note("actor", lambda: {"gain": th.tensor([1.0, 3.0])})
    assert diagnostics.read() == {"loss": 2.0, "gain": 2.0, "gain_1": 1.0, "gain_2": 3.0}
    assert computed == [2]


def test_nothing_noted_is_nothing_read() -> None:
    assert Diagnostics().read() == {}
