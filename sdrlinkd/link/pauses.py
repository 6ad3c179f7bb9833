"""How long the pauses of another robot usually are."""

DECAY = 0.98


def usual_gap(gap_s: float, usual_s: float) -> float:
    """The longest usual gap in s between two signs of a robot, after another one of `gap_s`.

    A long gap decays over some hundred signs.
    """
    return max(gap_s, DECAY * usual_s)
