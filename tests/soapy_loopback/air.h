// What a unit radiates, and what another hears of it.
#pragma once
#include <vector>

#include "dsp.h"
#include "layout.h"

namespace loopback {

// Puts samples of one unit on the air.
class Emission {
  public:
    explicit Emission(Unit &unit) : unit_(unit) {}

    void tune(const Tuning &tuning);
    // Converted now, heard only once published at the index of its first sample.
    void stage(const void *in, Format format, int bits, int64_t n);
    void publish(int64_t start, int64_t n, double rate);
    void drop_staged() { staged_ = 0; }
    // Nothing from `index` on is on the air; returns how many samples that takes off it.
    int64_t cut(int64_t index);

  private:
    Unit &unit_;
    int64_t written_ = 0, staged_ = 0;
};

// Who listens: with what carrier frequency, gain, clock, and behind how long a path.
struct Listener {
    double rate = 0, frequency = 0, amplitude = 1;
    int64_t delay = 0;
    Clock clock;
};

// Hears units, for one listener.
class Ear {
  public:
    // Adds what the unit sends to samples [first, first + n) of the listener.
    void add(const Unit &unit, const Listener &listener, int64_t first, size_t n, float *re,
             float *im);

  private:
    void add_tuned(const Unit &unit, const Tuning &tuning, const Listener &listener, int64_t first,
                   size_t n, float *re, float *im);
    bool fetch(const Unit &unit, const Tuning &tuning, float gain, int64_t first, size_t n);

    std::vector<float> re_, im_;
};

}  // namespace loopback
