"""What a command says while it works."""

from focus_planner.cli.progress import show_share


def test_a_share_is_shown_in_percent() -> None:
    said: list[str] = []
    show = show_share(said.append, "preparing scan.ply")
    for share in (0.0, 0.347, 1.0):
        show(share)
    assert said == [f"preparing scan.ply: {percent}%" for percent in (0, 35, 100)]
