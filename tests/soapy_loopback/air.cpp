#include "air.h"

#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

namespace loopback {
namespace {

template <typename Act>
void in_ring(int64_t offset, int64_t n, Act act) {
    const int64_t at = offset % RING, head = std::min(n, RING - at);
    act(at, 0, head);
    if (head < n) act(0, head, n - head);
}

bool is_alive(const Unit &unit) {
    const pid_t owner = unit.control.owner;
    return owner != 0 && (kill(owner, 0) == 0 || errno != ESRCH);
}

}  // namespace

void Emission::tune(const Tuning &tuning) {
    const uint64_t count = unit_.tunings;
    unit_.tuning[count % TUNINGS] = tuning;
    unit_.tunings.store(count + 1, std::memory_order_release);
}

void Emission::stage(const void *in, Format format, int bits, int64_t n) {
    const auto *from = static_cast<const uint8_t *>(in);
    in_ring(written_ + staged_, n, [&](int64_t at, int64_t skipped, int64_t count) {
        to_ring(from + skipped * bytes(format), format, bits, unit_.ring + 2 * at, count);
    });
    staged_ += n;
}

void Emission::publish(int64_t start, int64_t n, double rate) {
    const uint64_t count = unit_.segments;
    Segment *last = count ? &unit_.segment[(count - 1) % SEGMENTS] : nullptr;
    const bool follows = last && last->rate == rate && last->end == start &&
                         last->offset + (start - last->start) == written_;
    if (follows) {
        last->end.store(start + n, std::memory_order_release);
    } else {
        Segment &segment = unit_.segment[count % SEGMENTS];
        segment.start = start;
        segment.end = start + n;
        segment.offset = written_;
        segment.rate = rate;
        unit_.segments.store(count + 1, std::memory_order_release);
    }
    written_ += n;
    staged_ -= n;
}

int64_t Emission::cut(int64_t index) {
    int64_t taken = 0;
    const uint64_t count = unit_.segments;
    for (uint64_t k = count; k > 0 && count - k < SEGMENTS; k--) {
        Segment &segment = unit_.segment[(k - 1) % SEGMENTS];
        if (segment.end <= index) break;
        const int64_t end = std::max(index, segment.start);
        taken += segment.end - end;
        segment.end = end;
    }
    return taken;
}

void Ear::add(const Unit &unit, const Listener &listener, int64_t first, size_t n, float *re,
              float *im) {
    const uint64_t newest = unit.tunings.load(std::memory_order_acquire);
    size_t end = n;
    for (uint64_t k = newest; k > 0 && newest - k < TUNINGS - 1 && end > 0; k--) {
        const Tuning tuning = unit.tuning[(k - 1) % TUNINGS];
        const long double from = index_at(listener.clock.own(tuning.from_ns), listener.rate);
        const long double skip = std::ceil(from) + listener.delay - first;
        const size_t begin = skip <= 0 ? 0 : std::min<size_t>(end, skip);
        if (begin < end)
            add_tuned(unit, tuning, listener, first + begin, end - begin, re + begin, im + begin);
        end = begin;
    }
}

void Ear::add_tuned(const Unit &unit, const Tuning &tuning, const Listener &listener, int64_t first,
                    size_t n, float *re, float *im) {
    const double offset = tuning.frequency - listener.frequency;
    if (tuning.rate != listener.rate || std::fabs(offset) >= listener.rate / 2) return;
    const double rate = listener.rate;
    const bool same_clock = tuning.clock.skew == 1 && listener.clock.skew == 1;
    const double step = same_clock ? 1 : tuning.clock.skew / listener.clock.skew;
    const long double air_ns = listener.clock.air(time_of(first - listener.delay, rate));
    const long double position = index_at(tuning.clock.own(air_ns), rate);
    const int64_t base = same_clock ? first - listener.delay : int64_t(std::floor(position));

    const int64_t from = same_clock ? base : base - (TAPS / 2 - 1);
    const size_t count = same_clock ? n : size_t(std::ceil(n * step)) + 2 * TAPS;
    if (!fetch(unit, tuning, tuning.amplitude * listener.amplitude, from, count)) return;
    if (offset != 0) {
        const long double start = tuning.clock.air(time_of(from, rate)) / 1e9L * offset;
        rotate(re_.data(), im_.data(), double(start - std::floor(start)),
               offset / (rate * tuning.clock.skew), count);
    }
    if (same_clock) {
        loopback::add(re_.data(), re, n);
        loopback::add(im_.data(), im, n);
    } else {
        resample_add(re_.data(), im_.data(), double(position - base), step, re, im, n);
    }
}

// Into re_ and im_; false when there is nothing.
bool Ear::fetch(const Unit &unit, const Tuning &tuning, float gain, int64_t first, size_t n) {
    const float leak = tuning.leak > 0 && is_alive(unit) ? tuning.leak * gain : 0;
    re_.resize(std::max(re_.size(), n));
    im_.resize(re_.size());
    fill(re_.data(), leak, n);
    fill(im_.data(), 0, n);
    bool any = leak > 0;
    const int64_t last = first + int64_t(n);
    const uint64_t count = unit.segments.load(std::memory_order_acquire);
    for (uint64_t k = count; k > 0 && count - k < SEGMENTS - 1; k--) {
        const Segment &segment = unit.segment[(k - 1) % SEGMENTS];
        const int64_t end = segment.end.load(std::memory_order_acquire);
        if (segment.rate != tuning.rate || (end <= first && end > segment.start)) break;
        const int64_t from = std::max(first, segment.start), to = std::min(last, end);
        if (from >= to) continue;
        any = true;
        in_ring(segment.offset + from - segment.start, to - from,
                [&](int64_t at, int64_t skipped, int64_t run) {
                    const int64_t out = from - first + skipped;
                    from_ring(unit.ring + 2 * at, gain, &re_[out], &im_[out], run);
                });
    }
    return any;
}

}  // namespace loopback
