// One unit on the bus: its clock, what both directions are tuned to, and who has the antenna.
#pragma once
#include <mutex>

#include "air.h"
#include "bus.h"
#include "settings.h"

namespace loopback {

enum class Mode { OFF, RX, TX };

struct Tuned {
    double rate, frequency, gain_db;
};

class Station {
  public:
    explicit Station(const Settings &settings);
    ~Station();

    bool gone() const { return !control.is_plugged(); }

    // These want `mutex` held.
    int64_t now(double rate) const;
    int64_t ready(double rate) const;
    int64_t own_ns() const;
    // Whether the carrier or the clock changed: what is sent from now on is sent so.
    void retune();
    void set_clock();
    // Half duplex: the antenna changes hands; it is there when `ready` says.
    void enter(Mode mode);
    Listener listener() const;
    int64_t monotonic(int64_t index, double rate) const;
    void show_on_air(int64_t start, int64_t end);

    std::mutex mutex;
    Settings settings;
    Bus bus;
    Unit &unit;
    Control &control;
    Emission emission;
    Clock clock;
    Tuned rx, tx;
    std::atomic<Mode> mode{Mode::OFF};
    int64_t time_offset_ns = 0;

  private:
    double carrier(double frequency) const;

    int64_t ready_ns_ = 0, tuned_ns_ = 0;
};

}  // namespace loopback
