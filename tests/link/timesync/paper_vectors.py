"""Golden sequences for the clock-synchronisation filter of Cotta et al., "Latency Reduction and
Packet Synchronization ...", Sensors 2023: Equations 1 to 9 and Algorithm 3, in 50 digits."""

from decimal import Context, Decimal, localcontext

ALPHA_MAX = BETA_MAX = Decimal("0.05")
ALPHA_MIN = BETA_MIN = Decimal("0.003")
MAX_RTT, MAX_DEVIATION = Decimal("0.010"), Decimal("0.100")
CONVERGENCE_WINDOW, MAX_HIGH_DEVIATIONS = 500, 5
PERIOD, START, OFFSET, SKEW_PPM = 20_000, 1_000_000_000, 987_654_321, 20


class Filter:
    """Algorithm 3. Offset in seconds (local minus remote clock), skew in seconds per sample."""

    def __init__(self):
        self.resets = 0
        self.reset()

    def reset(self):
        """RESET_FILTER, lines 43 to 50."""
        self.n = 0
        self.offset = self.skew = Decimal(0)
        self.alpha, self.beta = ALPHA_MAX, BETA_MAX
        self.high_deviation_count = self.high_rtt_count = 0

    def converged(self):
        """Equation 6."""
        return self.n >= CONVERGENCE_WINDOW

    def update(self, stamps):
        """UPDATE, lines 9 to 33, for stamps in microseconds: see `observe` for their order."""
        if min(stamps[1:-1]) <= 0:
            return
        with localcontext(Context(prec=50)):
            observed, rtt = observe(stamps)
            if not rtt < MAX_RTT:
                self.high_rtt_count += 1
            elif self.converged() and abs(self.offset - observed) > MAX_DEVIATION:
                self.high_deviation_count += 1
                if self.high_deviation_count > MAX_HIGH_DEVIATIONS:
                    self.reset()
                    self.resets += 1
            else:
                self.alpha, self.beta = self.gains()
                self.add_sample(observed)
                self.n += 1
                self.high_deviation_count = self.high_rtt_count = 0

    def gains(self):
        """Equations 7 to 9, and the smallest gains once converged (lines 20 to 27)."""
        if self.converged():
            return ALPHA_MIN, BETA_MIN
        progress = Decimal(self.n) / CONVERGENCE_WINDOW
        p = 1 - (Decimal("0.5") * (1 - 1 / (1 - progress))).exp()
        return p * ALPHA_MIN + (1 - p) * ALPHA_MAX, p * BETA_MIN + (1 - p) * BETA_MAX

    def add_sample(self, observed):
        """ADD_SAMPLE, lines 35 to 42: Equations 2 and 3; the first sample leaves the skew at 0."""
        if self.n == 0:
            self.offset = observed
            return
        last = self.offset
        self.offset = self.alpha * observed + (1 - self.alpha) * (last + self.skew)
        self.skew = self.beta * (self.offset - last) + (1 - self.beta) * self.skew


def observe(stamps):
    """Observed offset and round-trip time in seconds, from stamps in microseconds.

    Three stamps are packet creation, remote, current (Equations 1 and 4). Four are local send,
    remote receive, remote send, local receive: the same with the remote turnaround taken out.
    """
    t1, t2, t3, t4 = stamps if len(stamps) == 4 else (*stamps[:2], *stamps[1:])
    return Decimal((t1 + t4) - (t2 + t3)) / 2_000_000, Decimal((t4 - t1) - (t3 - t2)) / 1_000_000


def jitter(state=12345):
    """One-way delays of 500 to 1500 us, from a linear congruential generator."""
    while True:
        state = (1_103_515_245 * state + 12_345) % 2**31
        yield 500 + (state >> 16) % 1001


def exchanges(count, rtts=(), shifts=(), turnaround=0):
    """(t1, t2, t3, t4) in microseconds at 50 Hz, the offset growing by 20 ppm.

    rtts: index to a forced round-trip time (us), all but 500 us of it on the way back.
    shifts: index to a change of the offset (us) at that sample.
    """
    delay, rtts, shifts = jitter(), dict(rtts), dict(shifts)
    for i in range(count):
        up, down = next(delay), next(delay)
        if i in rtts:
            up, down = 500, rtts[i] - 500
        t1 = START + i * PERIOD
        arrival = t1 + up
        drift = (arrival - START) * SKEW_PPM // 1_000_000
        t2 = arrival - OFFSET - drift - shifts.get(i, 0)
        yield t1, t2, t2 + turnaround, arrival + turnaround + down


def three(count, remotes=(), **options):
    """(packet creation, remote, current) in microseconds; remotes: index to a forced stamp."""
    remotes, samples = dict(remotes), enumerate(exchanges(count, **options))
    return [(t1, remotes.get(i, t2), t4) for i, (t1, t2, _, t4) in samples]


CASES = {
    "steady": three(700),
    # 10 000 us is high and 9 999 us is not; 250 000 us is also deviant, and counts as high only.
    "high_rtt": three(
        700,
        rtts={
            0: 10_000,
            1: 10_001,
            2: 9_999,
            **dict.fromkeys(range(100, 112), 15_000),
            300: 10_000,
            301: 9_999,
            650: 10_000,
            651: 9_999,
            660: 250_000,
            699: 20_000,
        },
    ),
    # Five samples deviant by -200 ms, which a good one clears; then the step: six deviant samples
    # (600 to 602 and 604 to 606), with a high RTT among them that does not clear their count.
    "step_200ms_converged": three(
        1200,
        rtts={603: 20_000},
        shifts={
            **dict.fromkeys(range(520, 525), -200_000),
            **dict.fromkeys(range(600, 1200), 200_000),
        },
    ),
    "step_50ms_converged": three(1200, shifts=dict.fromkeys(range(600, 1200), 50_000)),
    "step_200ms_unconverged": three(700, shifts=dict.fromkeys(range(100, 700), 200_000)),
    "remote_not_positive": three(
        700, remotes={0: 0, 1: -5, 50: 0, 300: -1, 650: 0}, rtts={50: 20_000}
    ),
    # 10 500 us in all with the turnaround is 9 500 us without it, which is not high.
    "four_stamps": list(
        exchanges(700, turnaround=1_000, rtts={200: 9_500, 201: 10_000, 202: 9_999, 699: 10_000})
    ),
}

# Index (from 0), offset (s), skew (s per sample), n, high deviations, high RTTs, resets.
CHECKPOINTS = {
    "steady": [
        (1, "987.654583703107", "-1.64689480259325e-7", 2, 0, 0, 0),
        (100, "987.654358354042", "0.00000123019191089970", 101, 0, 0, 0),
        (500, "987.654590855646", "8.05327136177296e-7", 501, 0, 0, 0),
        (699, "987.654683841381", "6.47482235572354e-7", 700, 0, 0, 0),
    ],
    "high_rtt": [
        (1, "0", "0", 0, 0, 2, 0),
        (2, "987.6588205", "0", 1, 0, 0, 0),
        (111, "987.654255961422", "0.0000179449578639379", 98, 0, 12, 0),
        (660, "987.654598544817", "2.67349400101562e-7", 644, 0, 1, 0),
        (699, "987.654604647023", "2.55794158381382e-7", 682, 0, 1, 0),
    ],
    "step_200ms_converged": [
        (524, "987.654601976173", "7.93091704392677e-7", 520, 5, 0, 0),
        (525, "987.654602423457", "7.92054281012414e-7", 521, 0, 0, 0),
        (605, "987.654644555653", "7.46528124655858e-7", 595, 5, 1, 0),
        (606, "0", "0", 0, 0, 0, 1),
        (607, "987.854569", "0", 1, 0, 0, 1),
        (1199, "987.854794696043", "5.09695016750754e-7", 593, 0, 0, 1),
    ],
    "step_50ms_converged": [
        (600, "987.654795344107", "0.00000118634429956075", 601, 0, 0, 0),
        (605, "987.655546156497", "0.00000340760369991245", 606, 0, 0, 0),
        (1199, "987.716277783133", "0.0000707072816916090", 1200, 0, 0, 0),
    ],
    "step_200ms_unconverged": [
        (100, "987.663253824926", "0.000396877203177618", 101, 0, 0, 0),
        (500, "987.860425081975", "0.0000544623017509750", 501, 0, 0, 0),
        (699, "987.864770396182", "0.0000391523531828863", 700, 0, 0, 0),
    ],
    "remote_not_positive": [
        (2, "987.65388", "0", 1, 0, 0, 0),
        (50, "987.654478762638", "0.00000935505535621233", 48, 0, 0, 0),
        (699, "987.654669260320", "5.97773385028219e-7", 695, 0, 0, 0),
    ],
    "four_stamps": [
        (200, "987.654547727443", "0.00000483014276568856", 201, 0, 0, 0),
        (201, "987.654547727443", "0.00000483014276568856", 201, 0, 1, 0),
        (202, "987.654711619417", "0.0000106491402519210", 202, 0, 0, 0),
        (699, "987.654616139818", "4.85325679387495e-7", 698, 0, 1, 0),
    ],
}


def states(samples):
    """State after every sample, offset and skew as Decimal."""
    f = Filter()
    for stamps in samples:
        f.update(stamps)
        yield f.offset, f.skew, f.n, f.high_deviation_count, f.high_rtt_count, f.resets


def golden(case):
    """Yield, after every sample of CASES[case], (offset_estimated_s, skew_estimated_s, n,
    high_deviation_count, high_rtt_count, resets); the skew is in seconds per sample."""
    for offset, skew, *counts in states(CASES[case]):
        yield (float(offset), float(skew), *counts)
