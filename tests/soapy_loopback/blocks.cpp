#include "blocks.h"

#include <SoapySDR/Constants.h>
#include <SoapySDR/Errors.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace loopback {
namespace {

constexpr int64_t NAP_NS = 2'000'000;

}  // namespace

int64_t BlockSender::in_flight() const {
    return station_.settings.in_flight * station_.settings.tx_block;
}

// Blocks leave the queue when they are in flight, else when they are over.
bool BlockSender::has_room(int64_t now) const {
    const int64_t block = station_.settings.tx_block;
    const auto waits = [&](int64_t start) { return start + block - in_flight() > now; };
    const int64_t waiting = std::count_if(starts_.begin(), starts_.end(), waits);
    return (waiting + 1) * block <= station_.settings.tx_buffer;
}

void BlockSender::advance(int64_t now) {
    if (origin_ < 0) {
        if (station_.mode != Mode::TX && station_.settings.half_duplex) return;
        origin_ = seen_ = next_ = std::max(now, station_.ready(station_.tx.rate));
    }
    for (; seen_ <= now; seen_ += station_.settings.tx_block) {
        while (!starts_.empty() && starts_.front() < seen_) starts_.pop_front();
        if (!starts_.empty() && starts_.front() == seen_) continue;
        station_.control.underflows++;
        underflow_ = true;
    }
    if (station_.control.underflow.exchange(0)) underflow_ = true;
}

void BlockSender::send_block(int64_t now) {
    const int64_t block = station_.settings.tx_block;
    const double rate = station_.tx.rate;
    const int64_t lead = std::ceil(station_.settings.tx_latency_s * rate) + in_flight();
    const int64_t soonest = origin_ + (now + lead - origin_ + block - 1) / block * block;
    const int64_t start = std::max({next_, soonest, origin_});
    station_.emission.publish(start, block, rate);
    station_.show_on_air(start, start + block);
    station_.control.sent += block;
    starts_.push_back(start);
    next_ = start + block;
    filled_ = 0;
}

int BlockSender::write(const void *in, size_t n, int, long long, long timeout_us) {
    const Settings &settings = station_.settings;
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    const int64_t wanted = std::min<int64_t>(n, settings.mtu);
    int64_t done = 0;
    while (true) {
        if (station_.gone()) return SOAPY_SDR_STREAM_ERROR;
        {
            const std::lock_guard lock(station_.mutex);
            if (settings.half_duplex) station_.enter(Mode::TX);
            const int64_t now = station_.now(station_.tx.rate);
            advance(now);
            while (done < wanted && (filled_ > 0 || has_room(now))) {
                const int64_t count = std::min(wanted - done, settings.tx_block - filled_);
                const auto *from = static_cast<const uint8_t *>(in) + done * bytes(format_);
                station_.emission.stage(from, format_, settings.bits, count);
                done += count;
                filled_ += count;
                if (filled_ == settings.tx_block) send_block(station_.now(station_.tx.rate));
            }
        }
        if (done == wanted) return done;
        const int64_t left = deadline - monotonic_ns();
        if (left <= 0) return done > 0 ? done : SOAPY_SDR_TIMEOUT;
        sleep_ns(std::min(left, NAP_NS));
    }
}

int BlockSender::status(int &, long long &, long timeout_us) {
    if (!station_.settings.status) return SOAPY_SDR_NOT_SUPPORTED;
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    while (true) {
        if (station_.gone()) return SOAPY_SDR_STREAM_ERROR;
        {
            const std::lock_guard lock(station_.mutex);
            advance(station_.now(station_.tx.rate));
            if (std::exchange(underflow_, false)) return SOAPY_SDR_UNDERFLOW;
        }
        const int64_t left = deadline - monotonic_ns();
        if (left <= 0) return SOAPY_SDR_TIMEOUT;
        sleep_ns(std::min(left, NAP_NS));
    }
}

void BlockSender::forget() {
    const int64_t now = station_.now(station_.tx.rate);
    advance(now);
    station_.control.sent -= station_.emission.cut(now);
    station_.control.on_until_ns = std::min<int64_t>(station_.control.on_until_ns, monotonic_ns());
    starts_.clear();
    origin_ = -1;
    next_ = 0;
}

}  // namespace loopback
