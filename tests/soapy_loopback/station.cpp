#include "station.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopback {
namespace {

// At these gains, and no loss, what is received is what was sent.
constexpr double NOMINAL_RX_DB = 20, NOMINAL_TX_DB = 40;

double amplitude(double db) { return std::pow(10, db / 20); }

}  // namespace

Station::Station(const Settings &given)
    : settings(given),
      bus(given.bus, given.speed),
      unit(bus.unit(given.unit)),
      control(unit.control),
      emission(unit) {
    bus.claim(settings.unit);
    control.owner = getpid();
    control.plugged = control.unplugs.load();
    control.opened++;
    emission.cut(std::numeric_limits<int64_t>::min());
    const double rate = std::max(settings.min_rate, std::min(1e6, settings.max_rate));
    rx = tx = {rate, std::max(100e6, settings.model->min_frequency), 0};
    for (const GainElement &element : settings.model->rx_gains) rx.gain_db += element.initial;
    for (const GainElement &element : settings.model->tx_gains) tx.gain_db += element.initial;
    set_clock();
}

Station::~Station() {
    enter(Mode::OFF);
    emission.cut(now(tx.rate));
    control.owner = 0;
}

int64_t Station::own_ns() const { return std::llround(clock.own(bus.air_ns())); }

int64_t Station::now(double rate) const {
    return std::floor(index_at(clock.own(bus.air_ns()), rate));
}

int64_t Station::ready(double rate) const {
    return std::ceil(index_at(clock.own(ready_ns_), rate));
}

int64_t Station::monotonic(int64_t index, double rate) const {
    return bus.monotonic(std::llround(clock.air(time_of(index, rate))));
}

double Station::carrier(double frequency) const {
    return frequency * (1 + settings.ppm * 1e-6) + settings.cfo;
}

void Station::set_clock() {
    const double lie = settings.lie ? 1 + settings.rate_error : 1;
    const double skew = (1 + settings.ppm * 1e-6) * lie;
    if (skew != clock.skew) clock = clock.with_skew(skew, bus.air_ns());
    retune();
}

void Station::retune() {
    const bool leaks = mode == Mode::TX && settings.leak_db > -200;
    tuned_ns_ = std::max({bus.air_ns(), tuned_ns_, mode == Mode::TX ? ready_ns_ : 0});
    emission.tune({tuned_ns_, tx.rate, carrier(tx.frequency),
                   amplitude(tx.gain_db - NOMINAL_TX_DB), leaks ? amplitude(settings.leak_db) : 0,
                   clock});
}

void Station::enter(Mode other) {
    if (mode == other) return;
    if (mode == Mode::TX) control.sent -= emission.cut(now(tx.rate));
    mode = other;
    control.mode = int64_t(other);
    ready_ns_ = bus.air_ns() + int64_t(settings.turnaround_s * 1e9);
    retune();
}

Listener Station::listener() const {
    return {rx.rate, carrier(rx.frequency),
            amplitude(rx.gain_db - NOMINAL_RX_DB - settings.loss_db), settings.delay, clock};
}

void Station::show_on_air(int64_t start, int64_t end) {
    if (control.on_until_ns < monotonic_ns()) control.on_from_ns = monotonic(start, tx.rate);
    control.on_until_ns = monotonic(end, tx.rate);
}

}  // namespace loopback
