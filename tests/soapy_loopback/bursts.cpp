#include "bursts.h"

#include <SoapySDR/Constants.h>
#include <SoapySDR/Errors.h>

#include <algorithm>
#include <cmath>

namespace loopback {
namespace {

constexpr int64_t NAP_NS = 5'000'000;
constexpr size_t MAX_EVENTS = 1000;
// Who hears up to this moment must have been given the samples a little before it.
constexpr double GUARD_S = 50e-6;

}  // namespace

void BurstSender::tell(int code, int flags, int64_t index) {
    if (station_.settings.ack && events_.size() < MAX_EVENTS)
        events_.push_back({code, flags, index});
}

// Also takes back what was to be told of it.
void BurstSender::cut(int64_t now) {
    station_.control.sent -= station_.emission.cut(now);
    station_.control.on_until_ns = std::min<int64_t>(station_.control.on_until_ns, monotonic_ns());
    spans_.clear();
    const auto is_ahead = [&](const Event &event) { return event.index > now; };
    events_.erase(std::remove_if(events_.begin(), events_.end(), is_ahead), events_.end());
}

// A burst whose samples ran out before its end has failed.
void BurstSender::advance(int64_t now) {
    const bool fault = station_.control.underflow.exchange(0);
    if (fault) {
        cut(now);
        end_ = std::min(end_, now);
    }
    if (fault || (in_burst_ && !starved_ && now >= end_)) {
        starved_ = true;
        tell(SOAPY_SDR_UNDERFLOW, 0, end_);
        station_.control.underflows++;
    }
}

int64_t BurstSender::queued(int64_t now) {
    while (!spans_.empty() && spans_.front().end <= now) spans_.pop_front();
    int64_t sum = 0;
    for (const Span &span : spans_) sum += span.end - std::max(now, span.start);
    return sum;
}

// In the middle of a burst that is refused, what of it is there stays until its END_BURST.
bool BurstSender::refuse() {
    const bool returned = station_.settings.late_return;
    station_.emission.drop_staged();
    dropping_ = !returned;
    in_burst_ = in_burst_ && returned;
    station_.control.late++;
    return returned;
}

// Where samples go that are there now; false: too late.
bool BurstSender::place(bool timed, long long time_ns, int64_t now, int64_t &start) {
    const double rate = station_.tx.rate;
    const Settings &settings = station_.settings;
    const int64_t soonest = std::max(now + int64_t(std::ceil(settings.tx_latency_s * rate)),
                                     station_.ready(rate));
    const int64_t guard = std::ceil(GUARD_S * rate);
    if (in_burst_ && !starved_ && end_ < now + guard) {
        advance(std::max(now, end_));
    }
    const bool runs = in_burst_ && !starved_;
    start = runs ? end_ : std::max(soonest, end_);
    if (!timed || !settings.time) return true;
    const int64_t asked = SoapySDR::timeNsToTicks(time_ns - station_.time_offset_ns, rate);
    if (runs && std::llabs(asked - end_) <= 1) return true;
    start = asked;
    return asked >= end_ && (runs || asked >= soonest);
}

int64_t BurstSender::take(const void *in, int64_t n, bool timed, long long time_ns, int64_t now) {
    const int64_t room = station_.settings.tx_buffer - queued(now);
    const int64_t count = std::min(n, room);
    if (dropping_) return n;
    if (count <= 0) return 0;
    station_.emission.stage(in, format_, station_.settings.bits, count);
    int64_t start;
    now = station_.now(station_.tx.rate);
    if (!place(timed, time_ns, now, start) || station_.control.time_error.exchange(0)) {
        if (refuse()) return -1;
        // Its turn is when the one before has ended, and so is when it is found late.
        tell(SOAPY_SDR_TIME_ERROR, 0, std::max(now, end_));
        return n;
    }
    station_.emission.publish(start, count, station_.tx.rate);
    station_.show_on_air(start, start + count);
    station_.control.sent += count;
    in_burst_ = true;
    starved_ = false;
    end_ = start + count;
    if (!spans_.empty() && spans_.back().end == start) spans_.back().end = end_;
    else spans_.push_back({start, end_});
    return count;
}

void BurstSender::end_burst() {
    if (in_burst_) {
        station_.control.bursts++;
        tell(0, SOAPY_SDR_END_BURST, end_);
    }
    in_burst_ = dropping_ = starved_ = false;
}

int BurstSender::write(const void *in, size_t n, int flags, long long time_ns, long timeout_us) {
    const Settings &settings = station_.settings;
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    const bool ends = flags & SOAPY_SDR_END_BURST;
    const int64_t wanted = settings.fill ? n : std::min<int64_t>(n, settings.mtu);
    int64_t done = 0;
    while (true) {
        if (station_.gone()) return SOAPY_SDR_STREAM_ERROR;
        {
            const std::lock_guard lock(station_.mutex);
            if (settings.half_duplex) station_.enter(Mode::TX);
            const int64_t now = station_.now(station_.tx.rate);
            advance(now);
            const auto *from = static_cast<const uint8_t *>(in) + done * bytes(format_);
            const bool timed = done == 0 && (flags & SOAPY_SDR_HAS_TIME);
            const int64_t taken = take(from, wanted - done, timed, time_ns, now);
            if (taken < 0) return done > 0 ? done : SOAPY_SDR_TIME_ERROR;
            done += taken;
            if (done == int64_t(n)) {
                if (ends) end_burst();
                return n == 0 && settings.fill ? SOAPY_SDR_TIMEOUT : done;
            }
        }
        if (done > 0 && (!settings.fill || done == wanted)) return done;
        const int64_t left = deadline - monotonic_ns();
        if (left <= 0) return done > 0 ? done : SOAPY_SDR_TIMEOUT;
        const double share = std::min<int64_t>(wanted - done, settings.tx_buffer / 4);
        const int64_t nap = share / (station_.tx.rate * settings.speed) * 1e9;
        sleep_ns(std::min({left, NAP_NS, std::max<int64_t>(nap, 50'000)}));
    }
}

int BurstSender::status(int &flags, long long &time_ns, long timeout_us) {
    if (!station_.settings.ack) return SOAPY_SDR_NOT_SUPPORTED;
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    while (true) {
        if (station_.gone()) return SOAPY_SDR_STREAM_ERROR;
        int64_t due = deadline;
        {
            const std::lock_guard lock(station_.mutex);
            const double rate = station_.tx.rate;
            const int64_t now = station_.now(rate);
            advance(now);
            for (auto event = events_.begin(); event != events_.end(); ++event) {
                if (event->index > now) {
                    due = std::min(due, station_.monotonic(event->index, rate));
                    continue;
                }
                flags = event->flags | (station_.settings.time ? SOAPY_SDR_HAS_TIME : 0);
                time_ns = SoapySDR::ticksToTimeNs(event->index, rate) + station_.time_offset_ns;
                const int code = event->code;
                events_.erase(event);
                return code;
            }
        }
        const int64_t now = monotonic_ns();
        if (now >= deadline) return SOAPY_SDR_TIMEOUT;
        sleep_ns(std::min(std::max<int64_t>(due - now, 20'000), NAP_NS));
    }
}

void BurstSender::forget() {
    cut(station_.now(station_.tx.rate));
    in_burst_ = dropping_ = starved_ = false;
    end_ = 0;
}

}  // namespace loopback
