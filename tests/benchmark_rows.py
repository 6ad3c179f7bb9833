"""The rows that each benchmark prints."""

from benchmarks.timesync.moving import MOTIONS

ROWS = {
    "timesync": {
        *(f"rms_us_60s_5hz_{each}" for each in "ABCDJL"),
        *(f"gain_over_paper_{each}" for each in "ABCDJL"),
        "below_1ms_after_s_median_worst",
        "step_recovery_s_worst",
        "bad_stamps_1pct_rms_us",
        "off_by_500ppm_rms_us",
        "bound_holds_pct",
        *(f"rms_us_{each}" for each in MOTIONS),
        "clock_bound_held_pct",
        "sample_clock_rms_us_1msps",
    },
    "bus": {
        "ingress_msgs_per_cpu_s_700B",
        "path_cost_over_crc_and_join_1024B",
        "path_latency_ms_p50",
        "queue_cost_ratio_10_to_10000",
    },
    "sealing": {
        *(f"seal_and_open_over_bare_{size}B" for size in (64, 256, 1024)),
        "core_pct_at_1000_pdus_per_s_each_way",
        "latency_added_us",
        *(f"goodput_kept_{size}B_pct" for size in (64, 1024)),
        "overhead_octets",
    },
    "repeats": {
        "delivered_in_0.3s_5pct_bursts_pct",
        "delivered_in_1s_20pct_bursts_pct",
        "delivered_in_0.3s_5pct_random_pct",
        "images_delivered_2pct_random_pct",
        "urgent_lost_twice_pct",
    },
    "defaults": {
        *(
            f"odom_beside_{big}_{each}" for big in ("200kB", "1MB", "3MB")
            for each in ("pct", "p50_ms", "p99_ms")
        ),
        *(f"big_{big}_of_the_rest_pct" for big in ("200kB", "1MB", "3MB")),
        "400kB_best_effort", "1500kB_reliable",
        *(f"alone_{size}_pct" for size in ("50kB", "400kB", "800kB", "1500kB")),
        *(
            f"{each}_{air}"
            for air in ("1ch", "1ch_both", "full_duplex", "1ch_adaptive", "1ch_sealed")
            for each in ("laser", "laser_std", "laser_p99", "image", "image_pct")
        ),
        *(
            f"laser_after_{pause}_{each}" for pause in ("22s", "random_pauses")
            for each in ("over_before", "p99_ms")
        ),
        *(f"outage_first_{topic}_s" for topic in ("odom", "scan", "cmd_vel")), "outage_oldest_s",
        "latched_depth_5", "50_reliable_at_once", "two_best_effort",
        "fair_wait_over_bound", "fair_bounds_broken",
        *(
            f"{where}nav2_{each}" for where in ("", "daemons_")
            for each in (
                "odom_pct", "tf_pct", "joints_pct", "scan_pct", "camera_pct", "costmap_pct",
                "p99_ms", "states_p99_ms",
            )
        ),
        *(f"daemons_odom_beside_200kB_{each}" for each in ("pct", "p50_ms", "p99_ms")),
        "daemons_400kB_best_effort", "daemons_image_ms", "daemons_image_pct",
        *(f"daemons_laser_{each}" for each in ("ms", "std_ms", "p99_ms", "pct")),
    },
    "fleet": {
        *(
            f"{each}_{n}_gateways" for n in (2, 3)
            for each in ("pdr", "lost_by", "twice", "added_ms_p50", "added_ms_p99")
        ),
        "added_ms_p50_1_gateway", "added_ms_p99_1_gateway",
        "hand_over_gap_s", "router_killed_s", "gateway_killed_s",
        "wan_pdr", "wan_twice", "wan_copies",
        *(f"wan_late_ms_{each}" for each in ("p50", "p90", "p99")),
        "lost_50_robots", "twice_50_robots", "router_cpu_pct",
        "page_desk_cpu_pct", "page_robot_cpu_pct",
    },
    "team": {
        "chain3_seed_mdr_laser", "chain3_seed_mdr_image", "chain3_seed_mdr_joystick",
        "chain3_seed_laser_D_ms", "chain3_seed_joystick_D_ms",
        "grant_halfduplex_50ms_urgent_p99_over_frame_standing",
        "grant_halfduplex_50ms_urgent_p99_over_frame_request",
        *(f"chain5_mdr_{flow}" for flow in ("laser", "image", "joystick")),
        *(
            f"{each}_{n}" for n in (8, 24)
            for each in (
                "bound_broken", "longest_wait_over_bound", "urgent_in_outages_pct",
                "urgent_lost_pct",
            )
        ),
        *(f"mobile_8_mdr_{qos}" for qos in ("urgent", "latency", "default")),
        "reroute_s", "reroute_to_all_s",
        "urgent_p99_ms_8", "urgent_p99_ms_24", "carried_mbps_8", "carried_mbps_24",
        "default_over_bulk_max_ms_8", "control_airtime_pct_8", "control_airtime_pct_24",
        *(f"rtwmp_table{n}_laser_{each}" for n in (1, 3) for each in ("ms", "std_ms", "mdr_pct")),
        *(
            f"rtwmp_table{n}_image_{each}"
            for n in (2, 4) for each in ("ms", "period_ms", "mdr_pct", "mbps")
        ),
        *(f"rtwmp_table5_{n}n_s" for n in (2, 3)),
        *(f"rtwmp_{each}_{n}" for n in (8, 24) for each in ("urgent_p99_ms", "carried_mbps")),
    },
    "modem_path": {
        "odom_30hz_latency_ms_p50",
        "odom_30hz_latency_ms_p99",
        "rx_realtime_ratio_5msps",
        "tx_realtime_ratio_5msps",
    },
    "waterfall": {
        *(f"{each}_us" for each in ("to_daemon", "accept", "to_compose", "compose", "to_modem")),
        *(f"{each}_us" for each in ("modulate", "lead", "air", "to_block", "receive", "to_link")),
        *(f"{each}_us" for each in ("hear", "to_consumer", "all")),
    },
    "realtime": {
        "laser_ms_mean",
        "laser_ms_std",
        "laser_beside_image_ms_mean",
        "laser_beside_image_ms_std",
        "odom_30hz_ms_p50",
        "odom_30hz_ms_p99",
        "demo_p99_ms",
        "two_daemons_beyond_air_ms_mean",
        "two_daemons_beyond_air_ms_p99",
        "age_error_us_p99",
        "idle_cpu_pct_5msps",
        "cpu_pct_two_robots_and_air_5msps",
        "loopback_10msps_lost_samples",
        "loopback_20msps_carried_share",
        "start_s",
        "status_s",
        "rss_mb",
        "rx_us_64B_burst_hot",
        "rx_us_64B_burst_asleep_20ms",
        "usrp_like_5msps_cores",
        "usrp_like_5msps_lost_samples",
    },
    "access": {
        "csma_2x15pct_pdr",
        "minislot_2x40pct_pdr",
        "minislot_2x40pct_delay_ms",
        "minislot_urgent_latency_ms_p99",
        "tdma_2x40pct_pdr",
        "tdma_2x40pct_delay_ms",
        "tdma_urgent_latency_ms_p99",
        "tdma_2x40pct_pdr_ta10ms",
        "none_2x40pct_pdr",
    },
    "pound": {
        "laser_2n_D_ms",
        "laser_2n_stdD_ms",
        "laser_2n_stdJd_ms",
        "image_2n_D_ms",
        "image_2n_stdD_ms",
        "mdr_2n_laser_pct",
        "mdr_2n_image_pct",
        *(
            f"{flow}_1ch{settings}_{each}"
            for flow in ("laser", "image")
            for settings in ("", "_defaults")
            for each in ("D_ms", "stdD_ms", "Jd_ms", "mdr_pct")
        ),
        "laser_3n_D_ms",
        "laser_3n_stdD_ms",
        "image_3n_D_ms",
        "image_3n_stdD_ms",
        "mdr_3n_pct",
        "user_mbps_64KB_of_6.0",
        "recovery_after_5s_outage_s",
        "recovery_after_5s_outage_image_s",
        "table5_2n_s",
        "table5_3n_s",
        "rlc_rms_vs_local_mV",
        "urgent_p99_ms",
        "scheduler_cost_ratio_10_to_10000_queued",
        "scheduler_cost_over_crc_and_join_1024B",
        "plan_error_pct",
        "laser_2n_D_ms_rt",
        "laser_2n_stdD_ms_rt",
        "laser_2n_stdJd_ms_rt",
        "image_2n_D_ms_rt",
        "image_2n_stdD_ms_rt",
        "mdr_2n_laser_pct_rt",
        "mdr_2n_image_pct_rt",
        "user_mbps_64KB_of_6.0_rt",
        "urgent_p99_ms_rt",
        "recovery_after_5s_outage_s_rt",
        "recovery_after_5s_outage_image_s_rt",
    },
    "phy_per": {
        "snr_db_per1e-2_64B_qpsk12_impaired",
        "snr_db_per1e-2_220B_bpsk12_impaired",
        "snr_db_per1e-2_220B_qpsk12_impaired",
        "snr_db_per1e-2_220B_16qam12_impaired",
        "snr_db_per1e-2_220B_64qam34_impaired",
        "snr_db_per1e-1_220B_qpsk12_tdl-a100ns_20msps",
        "gap_to_bound_db_220B_qpsk34_per1e-3",
        "header_ok_at_-2db",
        "doppler_40hz_1500B_qpsk12_5msps_per",
        "false_pdus_1e9_noise",
    },
    "rough": {
        *(f"joined_mid_stream_heard_gap{gap}_{db}db" for gap in (32, 200, 1000) for db in (8, 25)),
        *(
            f"deaf_after_strong_signal_ms_{who}_{msps}msps"
            for who in ("receiver", "carrier_sense") for msps in (1, 5)
        ),
        *(f"doppler_{hz}hz_1x1500B_5msps_lost" for hz in (100, 200)),
        *(f"doppler_{hz}hz_1x220B_1msps_lost" for hz in (40, 100)),
        *(f"doppler_40hz_{burst}_1msps_lost" for burst in ("5x64B", "4x220B")),
        *(f"gain_step_64qam_{db}db_lost" for db in (-3, -6)),
        *(f"cw_lost_{db}db" for db in (0, 20, 40)),
        *(f"{kind}_lost_10db" for kind in ("three_tones", "narrow", "sweep_10ms")),
        "sweep_10ms_lost_10db_220B_25db",
        *(f"pulses_2pct_lost_{db}db" for db in (0, 10)),
        *(
            f"{jammer}_64qam34_220B_25db"
            for jammer in ("cw_20db", "three_tones_10db", "pulses_2pct_0db")
        ),
        "cw_penalty_db", "cw_busy_share",
        *(f"excisor_clean_{profile}_lost_more" for profile in ("tdl-a", "tdl-c")),
        "second_burst_heard_mcs1_10db", "second_burst_heard_mcs6_20db",
        *(f"after_truncated_heard_{db}db" for db in (0, -6)),
        *(f"deaf_at_onset_of_a_tone_ms_{msps}msps" for msps in (1, 5)),
        "false_pdus",
    },
    "phy_speed": {
        "search_msps_noise",
        "search_msps_gfsk_+20db",
        "rx_msps_16x220B_qpsk12",
        "rx_msps_16x220B_64qam34",
        "rx_msps_1x64B_qpsk12",
        "tx_msps_220B_qpsk12",
        "rx_latency_us_220B_qpsk12",
    },
    "radio": {
        *(
            f"usrp_like_{msps}msps_{each}"
            for msps in (1, 2, 5, 10)
            for each in ("lost_samples", "underflows", "daemon_cpu_pct", "radio_process_cpu_pct")
        ),
        *(
            f"hackrf_like_odom_10hz_{way}_{each}"
            for way in ("oneway", "twoway")
            for each in ("p50_ms", "p99_ms", "pdr")
        ),
    },
    "flowgraphs": {
        f"{modem}_{size}b_{each}"
        for modem in ("ofdm_bpsk", "ofdm_qpsk", "gfsk")
        for size in (64, 220, 1000)
        for each in ("pdr", "p50_ms", "pdus_per_s")
    },
    "ether": {
        "lockstep_8nodes_1msps_realtime_ratio",
        "realtime_2nodes_5msps_lost_blocks",
    },
    "latency": {
        *(
            f"{way}_115B_200hz_{what}_ms_{to}"
            for way in ("line", "direct", "ether")
            for what in ("mean", "std") for to in ("fwd", "bwd")
        ),
        "line_cpu_share",
        "line_rss_mib",
        "ether_115B_200hz_beyond_air_mean_ms",
        "ether_115B_200hz_beyond_air_p99_ms",
        "ether_115B_200hz_lockstep_std_ms",
        "age_rms_us_lockstep",
        "e2e_offset_rms_us_5hz",
        "e2e_offset_rms_us_50hz",
        "age_rms_us_realtime",
        "control_airtime_pct_5nodes",
        "control_airtime_pct_5nodes_1msps",
        "line_under_stress_mean_ms",
        "line_topics_at_once_mean_ms",
        "loop_error_corrected_ratio",
        "loop_error_corrected_ratio_fresh",
    },
    "adapters": {
        "rclpy_in_cpu_ratio",
        "rclpy_out_us",
        "rclpy_added_ms_p50",
        "rclpy_idle_cpu_pct",
        "rclpy_idle_mb",
    },
}  # fmt: skip
