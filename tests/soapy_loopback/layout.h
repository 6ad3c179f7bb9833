// What lies in the shared memory of a bus. All zero is a bus on which nobody has been yet.
#pragma once
#include <atomic>
#include <cstdint>

#include "clock.h"

namespace loopback {

constexpr int64_t VERSION = 1;
constexpr int UNITS = 16;
constexpr uint64_t TUNINGS = 64;
constexpr uint64_t SEGMENTS = 1024;
// Samples a unit's ring holds: those queued for sending and those a slow reader has not read yet.
constexpr int64_t RING = 1 << 22;
constexpr int64_t MAX_QUEUE = RING / 2;

using Word = std::atomic<int64_t>;
static_assert(sizeof(Word) == 8 && Word::is_always_lock_free);

// Written and read by tests too: the order is that of FIELDS in __init__.py.
struct Control {
    Word unplugged, unplugs, stall, lose, underflow, time_error, crash, hang;
    Word owner, plugged, mode, on_from_ns, on_until_ns;
    Word sent, bursts, underflows, late, received, lost, overflows, opened;
    Word reserved[11];

    // Unplugged once, an open device stays so: only opening it anew helps.
    bool is_plugged() const { return plugged == unplugs; }
};

// How a transmitter is set from a moment on, until the next Tuning.
struct Tuning {
    int64_t from_ns;
    double rate, frequency, amplitude, leak;
    Clock clock;
};

// Contiguous samples on the air: [start, end) in the sender's count, of the ring from `offset` on.
struct Segment {
    int64_t start;
    Word end;
    int64_t offset;
    double rate;
};

struct Unit {
    Control control;
    std::atomic<uint64_t> tunings, segments;
    Tuning tuning[TUNINGS];
    Segment segment[SEGMENTS];
    alignas(4096) int16_t ring[2 * RING];
};

struct alignas(4096) Header {
    Word version;
    std::atomic<double> speed;
};

struct Memory {
    Header header;
    Unit unit[UNITS];
};

// bus.py relies on these.
static_assert(sizeof(Header) == 4096 && sizeof(Unit) == 16818176);

}  // namespace loopback
