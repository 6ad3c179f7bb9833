"""What `docs/benchmarks.md` says about each benchmark, above its table."""

TEXTS = {
    "bus": (
        "CPU time of one message through bus, queue and PDUs, in and out, beside ZeroMQ alone. "
        "The ratios compare with what cannot be avoided: a CRC, and a join of the fragments."
    ),
    "sealing": (
        "CPU time of one PDU, sealed at one robot and opened at another, beside the cipher alone; "
        "and of one message through both links, sealed beside in the clear."
    ),
    "repeats": (
        "Two links in virtual time on an air that loses PDUs, QPSK 1/2 at 1 Msps: 100 messages of "
        "100 B a second, or images. *block_code_16_n*: n - 16 packets of a code after each 16 "
        "messages, as in wfb-ng, with at least the airtime of our repeats. *nak_rfc3208*: negative "
        "acknowledgments with the times of OpenPGM's examples; it shares the air without beacons "
        "or clocks. Losses in bursts last 50 ms on average."
    ),
    "defaults": (
        "A team with the files that `init` writes for the simulated air, as whole links in virtual "
        "time; only the MCS is overridden, and in `..._adaptive` not even that. Producers declare "
        "their topics, for which nothing is configured. `daemons_...`: whole daemons and the "
        "simulated air's hub in real time, at a rate that this machine keeps up with. "
        "`fair_...`: random mixes of topics on one link. *before* is an earlier run of the same "
        "command (`--before`)."
    ),
    "fleet": (
        "Real daemons, gateways and a Zenoh router on one machine. An air of PDUs carries what the "
        "robot sends, 724 B at 100 Hz, and loses it for each gateway by chance: 6, 22 and 40 %. "
        "*lost_by*: messages that a gateway's daemon handed over and the operator never got. "
        "*added*: from the consumers at the daemon whose gateway put a message to the operator's "
        "program; *since_the_first_gateway*: from those of whichever daemon came first. "
        "*plain_zenoh* puts what each daemon hears as it comes, with the same losses, right after. "
        "In parentheses: on a machine where plain Zenoh adds 0.37 ms.\n\n"
        "The rows `wan_...` have a network of 40 ms between gateways and router; plain Zenoh uses "
        "it at the same time. Our gateways bring one copy of each message, so one that the leader "
        "missed waits for the other gateway."
    ),
    "team": (
        "Real links on an air of bursts in virtual time, half duplex, 5 Msps, 16QAM 1/2, 25 dB: "
        "robot 1 reaches robot 4 through 2 or 3, and robot 5 behind it. Beacons, clocks, LSA and "
        "ROUTE are on the same air. The relay in use dies at a random time.\n\n"
        "The rows `rtwmp_...` measure RT-WMP instead. It is written anew from the Pound paper, "
        "with the field sizes, the queue and the retries of its authors' program. In the tables "
        "it has the paper's channel, in virtual time: a frame takes 242 µs, and its octets at 6 "
        "Mbit/s. One value is fitted: hosts need 0.8 ms for each frame, so that Table II's images"
        " come as often as in the paper. *over_paper* is the value over the paper's; "
        "*no_host_time* is without the 0.8 ms. *as_programmed*: the token returns to who began "
        "the loop, as in that program, and hosts need 0.2 ms. *wait_100ms*: a node waits for 100 "
        "ms for an answer, as in that program, and 0.03 % of the frames of Tables I to IV are "
        "lost; elsewhere none is. The paper does not tell its losses. Its laser deviates more "
        "than ours, which so few losses explain; twice as many of our images come over two hops, "
        "which they do not explain. The delay of images grows throughout a run, so it depends on "
        "the run's length. Table V's times in the paper include cards that rejoin their network. "
        "In `rtwmp_urgent_...` and `rtwmp_carried_...`, RT-WMP has our air, without losses, and "
        "hosts need no time. With 24 robots, the link quality matrix makes each token 619 octets "
        "long."
    ),
    "modem_path": (
        "The first two rows are wall time through one daemon, its modem and a paced loopback. "
        "The others are CPU time of one core: how many times faster than the samples come."
    ),
    "realtime": (
        "Daemons, a hub, producers and consumers as programs on one machine, on the simulated air, "
        "at 5 Msps where the name says nothing else; the laser by 16QAM 1/2, the rest by QPSK 1/2. "
        "Each value is the median of three runs. A run in which a hypervisor took more than 10 % "
        "of the machine is repeated; if that does not help, the row has no target. *before*: an "
        "older checkout, run in turns with this one. An age's error is measured where the daemon "
        "hands the message over, beside a busy program on every core. Memory is PSS."
    ),
    "waterfall": (
        "Odometry of 724 B at 30 Hz through a daemon that hears itself: QPSK 1/2 at 5 Msps, a PDU "
        "of 1024 B. The median of each stage, in the order in which a message passes them; "
        "stamping is included. *before*: measured once in the same way, when modem and daemon were "
        "threads of one interpreter. `to_daemon` and `to_consumer` are ZeroMQ. A burst that is "
        "made later than planned begins late, so `lead` is negative, and `to_block` the longer."
    ),
    "phy_per": (
        "The modem alone: the SNR at which so many PDUs are lost, with everything that radios "
        "do to a signal (crystals 80 ppm apart, IQ images, leakage, DC, 8 bits, phase noise). "
        "liquid-dsp and GNU Radio are tested with a frequency offset only."
    ),
    "rough": (
        "The modem where the air is not still: receivers that begin within a burst, after strong "
        "signals, robots in motion (40 Hz is 5 m/s at 2.4 GHz), steps of gain. Shares of lost PDUs "
        "are upper 95 % bounds. A robot that senses the carrier believes in energy that no header "
        "explains for 40 ms."
    ),
    "phy_speed": (
        "Samples a second that one core's CPU time carries. In brackets the value scaled by how"
        " fast liquid-dsp runs here, against the machine that the targets were set on; it is "
        "not what *ok* judges."
    ),
    "access": (
        "Two half-duplex robots, 5 Msps, 16QAM 1/2, messages of 1 KB at random times that would"
        " fill 40 % of the air each (csma: 15 %), bursts of at most 5 ms, by the time of the "
        "samples. *Urgent* are short messages ten times a second: from one robot with mini-"
        "slots (`both_send_them`: from both), from both with tdma."
    ),
    "ether": "The simulated air: eight daemons in lock-step, and two in real time.",
    "radio": (
        "Two daemons on the test radio, in real time. Like a USRP, both send all the time and "
        "hear each other; like a HackRF, odometry of 720 B at 10 Hz, one way and both ways. "
        "Lost samples and underflows have targets up to 5 Msps. The peer is a plain loop in a "
        "thread of a busy process. The radio process's share of a core contains the test "
        "radio's driver, with its air and its noise. Where `machine_stolen_pct` is above 20, "
        "samples are lost at 2 Msps, too."
    ),
    "flowgraphs": "GNU Radio's flowgraphs as the modem, at 1 Msps and 25 dB.",
    "pound": (
        "16QAM 1/2 at 5 Msps, 6 Mbit/s. Ours are real links on an air of bursts, in virtual "
        "time, with clocks and repeats as in a daemon. In the same run, what teams use "
        "instead: programs in network namespaces, in real time, on an air of 6 Mbit/s, "
        "where a packet arrives when its airtime is over.\n\n"
        "*Which air.* In `..._2n_...`, `user_mbps_...` and `recovery_...`, each direction has "
        "an air of its own and there is no turnaround, for ours and for the others. In "
        "`..._1ch_...`, `..._3n_...`, `table5_...` and `rlc_...`, all robots share one "
        "half-duplex air. There, ours wait for an access policy, preambles and a turnaround "
        "of 0.1 ms. The packets of the others take turns, without any of these. Pound's "
        "figures in the column *paper* are from Wi-Fi, which is one half-duplex air. So only "
        "these rows compare with them.\n\n"
        "`..._1ch_...`: bursts of 20 ms, blocks of 0.2 ms, and PDUs that hold a laser "
        "message. `..._1ch_defaults_...`: a daemon's defaults, apart from sample rate and "
        "MCS. The value is that of the policy that `auto` selects: minislot in the former, "
        "tdma in the latter. *laser_first*: `tc` with two HTB classes, that of the laser's "
        "port first. *fq_codel*: behind that queue of Linux. `table5_...`: the sender or the "
        "relay is off for 5 s. In the paper, Wi-Fi cards rejoin their network in this time; "
        'here, nothing does. Ours learn their routes (`relay.policy = "auto"`); those of the '
        "others are fixed. `rlc_...`: 1 mV is a millisecond of delay.\n\n"
        "`pound_like` imitates Pound's scheme, with priorities at each hop. Our image is "
        "later than that of most others because the laser goes first. The rows `..._rt` are "
        "whole daemons in real time."
    ),
    "timesync": (
        "The same time stamps through clock filters: five exchanges a second, a tenth lost each"
        " way, queues of up to 20 ms; errors at 60 s, rms of 40 runs. Scenarios: A is idle 40 %"
        " of the time; B is busy one way; C never idle and lopsided; D never idle; J is D with "
        "1 ms of jitter; L is busy and idle by turns. Rows `rms_us_...` after `bound_holds_pct`: "
        "the difference of the two clocks' rates moves, or stamps are wrong; queues as in A. Errors"
        " count from 130 s on, when the paper's filter has converged. `held_pct` is the share of "
        "looks in which the error is within the reported bound. The 5 s after a jump of a clock or "
        "of its rate are left out. `by_sample`: stamps by samples at 5 Msps, no queue."
    ),
    "latency": (
        "The assessment of the Sensors 2023 paper as an emulation: 115 bytes 200 times a second"
        " each way between two processes with clocks of their own. Latencies are true ones, by the"
        " machine's clock. *corrected_mean* is what the paper's filter makes of the stamps of the "
        "two clocks; before it converges, nothing is corrected (*corrected_pct*). What is emulated:"
        " the serial line (paced at 921600 baud), the flight controller, the agent and MAVROS. "
        "Rows `line_...` can be compared with MAVLink, MAVROS and XRCE, as the line is the same: "
        "daemons reach it by TCP, the others by pseudo-terminals. Their targets are the paper's "
        "figures of MAVROS. *on_the_line* is the part of the mean that the line takes. Rows "
        "`direct_...` and `ether_...` have no line.\n\n"
        "The last rows close a control loop over links in lock-step, beside the bulk of four "
        "robots. The controller extrapolates by the age of each input, and by the ages of its "
        "answers, which the plant reports. Errors are those against a controller at the plant. "
        "The ratio is the RMS error over that of a controller that ignores ages; "
        "*mean_age_only* knows the mean of ages only. *fresh* is a faster channel."
    ),
    "adapters": (
        "Odometry of 724 B through the bridge `sdrlink_ros` and a daemon without a modem. The peer "
        "is a bridge of forty lines, with an executor and a callback. What is lost was displaced "
        "by newer messages at 1 kHz."
    ),
}
"""Text above the table of each benchmark."""
