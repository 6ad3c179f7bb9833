#include "receiver.h"

#include <SoapySDR/Constants.h>
#include <SoapySDR/Errors.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopback {
namespace {

constexpr size_t BLOCK = 2048;
constexpr int64_t NAP_NS = 10'000'000;
constexpr float GARBAGE_RMS = 0.3F;

}  // namespace

Receiver::Receiver(Station &station, Format format)
    : station_(station),
      format_(format),
      re_(BLOCK),
      im_(BLOCK),
      seed_(monotonic_ns() + station.settings.unit) {}

void Receiver::start(int64_t index, int64_t count, int64_t wrong) {
    const std::lock_guard lock(mutex_);
    station_.control.stall = 0;
    active_ = true;
    failed_ = false;
    rate_ = station_.rx.rate;
    origin_ = next_ = index;
    last_ = count > 0 ? index + count : std::numeric_limits<int64_t>::max();
    clean_ = index + wrong;
    lost_from_ = -1;
}

void Receiver::fail() {
    stop();
    failed_ = true;
}

void Receiver::stop() {
    const std::lock_guard lock(mutex_);
    active_ = false;
}

long long Receiver::stamp(int64_t index) const {
    return SoapySDR::ticksToTimeNs(index, rate_) + station_.time_offset_ns;
}

void Receiver::obey_faults() {
    Control &control = station_.control;
    if (control.crash.exchange(0)) raise(SIGSEGV);
    if (control.hang.exchange(0)) {
        while (true) sleep_ns(1'000'000'000);
    }
}

void Receiver::lose_samples() {
    const int64_t lose = station_.control.lose.exchange(0);
    if (lose > 0 && lost_from_ < 0) {
        lost_from_ = next_;
        lost_until_ = next_ + lose;
    }
}

// How many samples can be fetched; begins to lose them when too many wait.
int64_t Receiver::available() {
    const int64_t block = station_.settings.rx_block, buffer = station_.settings.rx_buffer;
    int64_t now;
    {
        const std::lock_guard lock(station_.mutex);
        if (station_.rx.rate != rate_) {
            rate_ = station_.rx.rate;
            origin_ = next_ = station_.now(rate_);
            lost_from_ = -1;
        }
        now = station_.now(rate_);
    }
    const int64_t there = origin_ + (now - origin_) / block * block;
    if (lost_from_ < 0 && now - next_ > buffer) {
        const bool keeps_newest = station_.settings.keeps_newest;
        lost_from_ = keeps_newest ? next_ : next_ + buffer;
        lost_until_ = keeps_newest ? there - (buffer - block) : 0;
    }
    const int64_t end = std::min(there, last_);
    return (lost_from_ < 0 ? end : std::min(end, lost_from_)) - next_;
}

int Receiver::overflow(int &flags, long long &time_ns) {
    const std::lock_guard lock(station_.mutex);
    time_ns = stamp(next_);
    flags = station_.settings.time ? SOAPY_SDR_HAS_TIME : SOAPY_SDR_END_ABRUPT;
    const int64_t from = lost_until_ > 0 ? lost_until_ : station_.now(rate_);
    station_.control.lost += from - next_;
    station_.control.overflows++;
    origin_ = next_ = from;
    lost_from_ = -1;
    return SOAPY_SDR_OVERFLOW;
}

int Receiver::read(void *out, size_t n, int &flags, long long &time_ns, long timeout_us) {
    const Settings &settings = station_.settings;
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    const int64_t wanted = settings.fill ? n : std::min<int64_t>(n, settings.mtu);
    int64_t done = 0;
    flags = 0;
    while (true) {
        if (station_.gone() || failed_.exchange(false)) return SOAPY_SDR_STREAM_ERROR;
        obey_faults();
        int64_t due = deadline;
        {
            const std::lock_guard lock(mutex_);
            lose_samples();
            if (active_ && !station_.control.stall) {
                const int64_t ready = available();
                if (done == 0 && lost_from_ == next_) return overflow(flags, time_ns);
                const int64_t take = std::min(wanted - done, ready);
                if (take > 0) {
                    if (done == 0) time_ns = stamp(next_);
                    render(static_cast<uint8_t *>(out) + done * bytes(format_), take);
                    done += take;
                }
                const bool over = next_ == last_;
                if (over) active_ = false;
                const bool enough = settings.fill ? done == wanted || lost_from_ >= 0 : done > 0;
                if (done > 0 && (enough || over || monotonic_ns() >= deadline)) {
                    if (settings.time) flags |= SOAPY_SDR_HAS_TIME;
                    if (over) flags |= SOAPY_SDR_END_BURST;
                    return done;
                }
                const int64_t block = settings.rx_block;
                const int64_t more = settings.fill ? wanted - done : 1;
                const int64_t until = std::min(next_ + more, next_ + settings.rx_buffer / 2);
                const int64_t blocks = (until - origin_ + block - 1) / block;
                const std::lock_guard station_lock(station_.mutex);
                due = std::min(due, station_.monotonic(origin_ + blocks * block, rate_));
            }
        }
        const int64_t now = monotonic_ns();
        if (now >= deadline) return done > 0 ? done : SOAPY_SDR_TIMEOUT;
        sleep_ns(std::min(std::max<int64_t>(due - now, 20'000), NAP_NS));
    }
}

void Receiver::render(void *out, int64_t n) {
    Listener listener;
    {
        const std::lock_guard lock(station_.mutex);
        listener = station_.listener();
    }
    auto *to = static_cast<uint8_t *>(out);
    for (int64_t done = 0; done < n;) {
        const size_t count = std::min<int64_t>(BLOCK, n - done);
        render_block(to + done * bytes(format_), count, listener);
        done += count;
        next_ += count;
    }
    station_.control.received += n;
}

void Receiver::render_block(void *out, size_t n, const Listener &listener) {
    const Settings &settings = station_.settings;
    fill(re_.data(), settings.dc, n);
    fill(im_.data(), settings.dc, n);
    if (next_ < clean_) {
        add_noise(re_.data(), im_.data(), GARBAGE_RMS, seed_, n);
    } else {
        for (int number = 0; number < UNITS; number++) {
            if (number == settings.unit && !settings.self) continue;
            const Unit &other = station_.bus.unit(number);
            if (other.control.is_plugged()) ear_.add(other, listener, next_, n, re_.data(), im_.data());
        }
        const float rms = std::pow(10.0, settings.noise_db / 20);
        if (settings.noise_db > -200) add_noise(re_.data(), im_.data(), rms, seed_, n);
    }
    from_planar(re_.data(), im_.data(), settings.bits, format_, out, n);
}

}  // namespace loopback
