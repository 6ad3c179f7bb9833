// Times. Air time is CLOCK_MONOTONIC slowed by the bus's speed; a device's clock may run off it.
#pragma once
#include <SoapySDR/Time.hpp>
#include <cmath>
#include <cstdint>
#include <ctime>

namespace loopback {

inline int64_t monotonic_ns() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

inline void sleep_ns(int64_t duration) {
    if (duration <= 0) return;
    timespec wait{duration / 1000000000, duration % 1000000000};
    nanosleep(&wait, nullptr);
}

// A device's own time; runs `skew` times as fast as the air's since the anchor.
struct Clock {
    int64_t air_ns = 0, own_ns = 0;
    double skew = 1;

    long double own(long double air) const {
        return skew == 1 ? air - air_ns + own_ns : own_ns + (air - air_ns) * skew;
    }
    long double air(long double own) const {
        return skew == 1 ? own - own_ns + air_ns : air_ns + (own - own_ns) / skew;
    }
    Clock with_skew(double other, int64_t now_ns) const {
        return {now_ns, std::llround(own(now_ns)), other};
    }
};

// The sample of this count is taken at this own time, and back.
inline long double time_of(long double index, double rate) { return index * 1e9L / rate; }
inline long double index_at(long double own_ns, double rate) { return own_ns * rate / 1e9L; }

}  // namespace loopback
