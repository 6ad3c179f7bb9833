#include "device.h"

#include <SoapySDR/Constants.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace loopback {
namespace {

[[noreturn]] void refuse(const std::string &what, double value) {
    throw std::invalid_argument("loopback: " + what + " out of range: " + std::to_string(value));
}

}  // namespace

Device::Device(const Settings &settings)
    : station_(std::make_unique<Station>(settings)), model_(*settings.model) {
    face(SOAPY_SDR_RX).antenna = model_.rx_antennas.front();
    face(SOAPY_SDR_TX).antenna = model_.tx_antennas.front();
    for (const int direction : {SOAPY_SDR_RX, SOAPY_SDR_TX}) {
        face(direction).asked_rate = tuned(direction).rate;
        for (const GainElement &one : elements(direction))
            face(direction).gains[one.name] = one.initial;
    }
}

Device::~Device() {
    if (sender_) stop_sending();
}

void Device::want_there() const {
    if (station_->gone()) throw std::runtime_error("loopback: the device has been unplugged");
}

std::string Device::getHardwareKey() const { return model_.name; }

SoapySDR::Kwargs Device::getHardwareInfo() const {
    const Settings &settings = station_->settings;
    return {{"bus", settings.bus},
            {"unit", std::to_string(settings.unit)},
            {"serial", settings.serial}};
}

bool Device::getFullDuplex(int, size_t) const { return !station_->settings.half_duplex; }

Tuned &Device::tuned(int direction) const {
    return direction == SOAPY_SDR_RX ? station_->rx : station_->tx;
}

std::vector<std::string> Device::listAntennas(int direction, size_t) const {
    return direction == SOAPY_SDR_RX ? model_.rx_antennas : model_.tx_antennas;
}

void Device::setAntenna(int direction, size_t, const std::string &name) {
    want_there();
    const auto known = listAntennas(direction, 0);
    if (std::find(known.begin(), known.end(), name) == known.end())
        throw std::invalid_argument("loopback: no antenna '" + name + "'");
    face(direction).antenna = name;
}

std::string Device::getAntenna(int direction, size_t) const { return face(direction).antenna; }

void Device::setFrequency(int direction, size_t, double hz, const SoapySDR::Kwargs &) {
    want_there();
    if (hz < model_.min_frequency || hz > model_.max_frequency) refuse("frequency", hz);
    const std::lock_guard lock(station_->mutex);
    tuned(direction).frequency = hz;
    if (direction == SOAPY_SDR_TX) station_->retune();
}

void Device::setFrequency(int direction, size_t channel, const std::string &name, double hz,
                          const SoapySDR::Kwargs &args) {
    if (name != "RF") throw std::invalid_argument("loopback: no frequency '" + name + "'");
    setFrequency(direction, channel, hz, args);
}

double Device::getFrequency(int direction, size_t) const { return tuned(direction).frequency; }

double Device::getFrequency(int direction, size_t, const std::string &) const {
    return tuned(direction).frequency;
}

SoapySDR::RangeList Device::getFrequencyRange(int, size_t) const {
    return {{model_.min_frequency, model_.max_frequency}};
}

SoapySDR::RangeList Device::getFrequencyRange(int, size_t channel, const std::string &) const {
    return getFrequencyRange(0, channel);
}

void Device::setSampleRate(int direction, size_t, double asked) {
    want_there();
    const Settings &settings = station_->settings;
    const bool raises = model_.name == "hackrf";
    const double hz = raises ? std::max(asked, settings.min_rate) : asked;
    if (hz < settings.min_rate || hz > settings.max_rate) refuse("sample rate", asked);
    if (direction == SOAPY_SDR_TX && sender_) {
        const std::lock_guard lock(station_->mutex);
        if (hz != face(direction).asked_rate) sender_->forget();
    }
    const std::lock_guard lock(station_->mutex);
    face(direction).asked_rate = hz;
    tuned(direction).rate = settings.lie ? hz : hz * (1 + settings.rate_error);
    if (direction == SOAPY_SDR_TX) station_->retune();
}

double Device::getSampleRate(int direction, size_t) const { return tuned(direction).rate; }

SoapySDR::RangeList Device::getSampleRateRange(int, size_t) const {
    return {{station_->settings.min_rate, station_->settings.max_rate}};
}

void Device::setBandwidth(int direction, size_t, double hz) {
    want_there();
    if (hz < 0 || hz > station_->settings.max_rate) refuse("bandwidth", hz);
    face(direction).bandwidth = hz;
}

double Device::getBandwidth(int direction, size_t) const {
    const double set = face(direction).bandwidth;
    return set > 0 ? set : tuned(direction).rate;
}

bool Device::hasHardwareTime(const std::string &) const { return station_->settings.time; }

long long Device::getHardwareTime(const std::string &) const {
    want_there();
    if (!station_->settings.time) return 0;
    const std::lock_guard lock(station_->mutex);
    return station_->own_ns() + station_->time_offset_ns;
}

void Device::setHardwareTime(long long time_ns, const std::string &) {
    want_there();
    const std::lock_guard lock(station_->mutex);
    station_->time_offset_ns = time_ns - station_->own_ns();
}

// "inject": a fault for this unit, or for another one of the bus: "unit=2:unplug".
void Device::writeSetting(const std::string &key, const std::string &value) {
    if (key == "inject") {
        const size_t colon = value.find(':');
        if (value.rfind("unit=", 0) != 0) return inject(station_->control, value);
        const int unit = std::stoi(value.substr(5, colon - 5));
        if (unit < 0 || unit >= UNITS) refuse("unit", unit);
        return inject(station_->bus.unit(unit).control, value.substr(colon + 1));
    }
    want_there();
    const std::lock_guard lock(station_->mutex);
    if (!station_->settings.set(key, value))
        throw std::invalid_argument("loopback: no setting '" + key + "'");
    station_->set_clock();
}

std::string Device::readSetting(const std::string &key) const {
    return station_->settings.get(key);
}

}  // namespace loopback
