"""An access policy whose decisions a test makes."""

import math


class Doorkeeper:
    """An access policy with preset answers, which records its calls."""

    def __init__(self, *slots):
        self.slots, self.told = list(slots), []

    state = "kept"
    pause_s = 0.0
    share = 1.0
    others_follow = False
    keeps_schedule = False
    by_request = by_auction = None
    tells_at = math.inf
    needs_links = False

    def know_links(self, edges):
        pass

    def slot(self, wish):
        return self.slots.pop(0)

    def sent(self, end, src):
        self.told.append(("sent", end))

    def not_sent(self, start):
        self.told.append(("not sent", start))

    def frame(self, start):
        return None
