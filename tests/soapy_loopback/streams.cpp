#include <SoapySDR/Constants.h>
#include <SoapySDR/Errors.h>

#include <algorithm>
#include <stdexcept>

#include "blocks.h"
#include "bursts.h"
#include "device.h"

namespace loopback {
namespace {

constexpr int64_t NAP_NS = 2'000'000;

Format find_format(const std::string &name) {
    if (name == "CF32") return Format::CF32;
    if (name == "CS16") return Format::CS16;
    if (name == "CS8") return Format::CS8;
    throw std::invalid_argument("loopback: no format " + name);
}

}  // namespace

std::vector<std::string> Device::getStreamFormats(int, size_t) const {
    return {"CF32", "CS16", "CS8"};
}

std::string Device::getNativeStreamFormat(int, size_t, double &full_scale) const {
    full_scale = model_.full_scale;
    return model_.native_format;
}

SoapySDR::Stream *Device::setupStream(int direction, const std::string &name,
                                      const std::vector<size_t> &channels,
                                      const SoapySDR::Kwargs &) {
    want_there();
    const Format format = find_format(name);
    if (channels.size() > 1 || (channels.size() == 1 && channels[0] != 0))
        throw std::invalid_argument("loopback: there is channel 0 only");
    if (direction == SOAPY_SDR_RX ? bool(receiver_) : bool(sender_))
        throw std::runtime_error("loopback: stream is already open");
    if (direction == SOAPY_SDR_RX) {
        receiver_ = std::make_unique<Receiver>(*station_, format);
        return reinterpret_cast<SoapySDR::Stream *>(receiver_.get());
    }
    if (station_->settings.tx_block > 1) sender_ = std::make_unique<BlockSender>(*station_, format);
    else sender_ = std::make_unique<BurstSender>(*station_, format);
    return reinterpret_cast<SoapySDR::Stream *>(sender_.get());
}

void Device::closeStream(SoapySDR::Stream *stream) {
    if (stream == reinterpret_cast<SoapySDR::Stream *>(receiver_.get())) {
        deactivateStream(stream, 0, 0);
        receiver_.reset();
    } else {
        stop_sending();
        station_->emission.drop_staged();
        sender_.reset();
    }
}

size_t Device::getStreamMTU(SoapySDR::Stream *) const { return station_->settings.mtu; }

// Takes the antenna from what is sending, and from its queue what is left there.
void Device::stop_sending() {
    const std::lock_guard lock(station_->mutex);
    if (sender_) sender_->forget();
    if (station_->mode == Mode::TX) station_->enter(Mode::OFF);
}

int Device::activateStream(SoapySDR::Stream *stream, int flags, long long time_ns, size_t count) {
    if (station_->gone()) return SOAPY_SDR_STREAM_ERROR;
    const bool half_duplex = station_->settings.half_duplex;
    if (stream != reinterpret_cast<SoapySDR::Stream *>(receiver_.get())) {
        const std::lock_guard lock(station_->mutex);
        if (half_duplex) station_->enter(Mode::TX);
        return 0;
    }
    if (half_duplex) {
        if (station_->mode == Mode::RX) return 0;
        stop_sending();
        return to_receive(0);
    }
    int64_t index;
    {
        const std::lock_guard lock(station_->mutex);
        const double rate = station_->rx.rate;
        index = station_->now(rate);
        if ((flags & SOAPY_SDR_HAS_TIME) && station_->settings.time) {
            const long long own = time_ns - station_->time_offset_ns;
            const int64_t asked = SoapySDR::timeNsToTicks(own, rate);
            if (asked < index) {
                receiver_->fail();
                return 0;
            }
            index = asked;
        }
    }
    receiver_->start(index, (flags & SOAPY_SDR_END_BURST) ? count : 0);
    return 0;
}

int Device::deactivateStream(SoapySDR::Stream *stream, int, long long) {
    if (stream == reinterpret_cast<SoapySDR::Stream *>(receiver_.get())) {
        receiver_->stop();
        const std::lock_guard lock(station_->mutex);
        if (station_->mode == Mode::RX) station_->enter(Mode::OFF);
    } else if (model_.name != "usrp") {
        stop_sending();
    }
    return station_->gone() ? SOAPY_SDR_STREAM_ERROR : 0;
}

// Half duplex: once all that is queued has left, listens.
int Device::to_receive(long timeout_us) {
    const int64_t deadline = monotonic_ns() + timeout_us * 1000LL;
    while (true) {
        {
            const std::lock_guard lock(station_->mutex);
            if (station_->mode == Mode::RX) return 0;
            const bool sends = station_->mode == Mode::TX && sender_;
            if (!sends || sender_->drained() <= station_->now(station_->tx.rate)) break;
        }
        const int64_t left = deadline - monotonic_ns();
        if (left <= 0) return SOAPY_SDR_TIMEOUT;
        sleep_ns(std::min(left, NAP_NS));
    }
    stop_sending();
    const Settings &settings = station_->settings;
    int64_t index;
    {
        const std::lock_guard lock(station_->mutex);
        station_->enter(Mode::RX);
        index = std::max(station_->ready(station_->rx.rate), station_->now(station_->rx.rate));
    }
    receiver_->start(index, 0, settings.keeps_newest ? settings.rx_block : 0);
    return 0;
}

int Device::readStream(SoapySDR::Stream *stream, void *const *buffers, size_t n, int &flags,
                       long long &time_ns, long timeout_us) {
    if (stream != reinterpret_cast<SoapySDR::Stream *>(receiver_.get()))
        return SOAPY_SDR_NOT_SUPPORTED;
    if (station_->settings.half_duplex && !station_->gone()) {
        const int refused = to_receive(timeout_us);
        if (refused < 0) return refused;
    }
    return receiver_->read(buffers[0], n, flags, time_ns, timeout_us);
}

int Device::writeStream(SoapySDR::Stream *stream, const void *const *buffers, size_t n, int &flags,
                        long long time_ns, long timeout_us) {
    if (stream != reinterpret_cast<SoapySDR::Stream *>(sender_.get()))
        return SOAPY_SDR_NOT_SUPPORTED;
    const bool listened = station_->mode == Mode::RX;
    const int written = sender_->write(buffers[0], n, flags, time_ns, timeout_us);
    if (listened && receiver_) receiver_->stop();
    flags = 0;
    return written;
}

int Device::readStreamStatus(SoapySDR::Stream *stream, size_t &channels, int &flags,
                             long long &time_ns, long timeout_us) {
    if (stream != reinterpret_cast<SoapySDR::Stream *>(sender_.get()))
        return SOAPY_SDR_NOT_SUPPORTED;
    channels = 1;
    flags = 0;
    return sender_->status(flags, time_ns, timeout_us);
}

}  // namespace loopback
