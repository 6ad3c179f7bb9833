// What a device is like: its model's ways, changed by the arguments it is made with.
#pragma once
#include <SoapySDR/Types.hpp>
#include <string>
#include <vector>

namespace loopback {

struct GainElement {
    std::string name;
    double max, step, initial;
};

struct Model {
    std::string name;
    std::vector<std::string> rx_antennas, tx_antennas;
    std::vector<GainElement> rx_gains, tx_gains;
    double min_frequency, max_frequency;
    std::string native_format;
    double full_scale;
};

struct Settings {
    explicit Settings(const SoapySDR::Kwargs &args);

    const Model *model;
    std::string bus, serial;
    int unit;
    bool half_duplex, fill, time, ack, status, late_return, self, lie, busy, absent, keeps_newest;
    // Samples. A tx_block above 1: only whole blocks leave, and END_BURST is not heeded.
    int64_t mtu, rx_block, tx_block, rx_buffer, tx_buffer, delay;
    int in_flight, bits;
    double tx_latency_s, turnaround_s, speed;
    double noise_db, loss_db, leak_db, cfo, ppm, dc;
    double min_rate, max_rate, rate_error;

    // Those a running device can change.
    bool set(const std::string &key, const std::string &value);
    std::string get(const std::string &key) const;
};

}  // namespace loopback
