#include <SoapySDR/Constants.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "device.h"

namespace loopback {

const std::vector<GainElement> &Device::elements(int direction) const {
    return direction == SOAPY_SDR_RX ? model_.rx_gains : model_.tx_gains;
}

const GainElement &Device::element(int direction, const std::string &name) const {
    for (const GainElement &one : elements(direction)) {
        if (one.name == name) return one;
    }
    throw std::invalid_argument("loopback: no gain '" + name + "'");
}

std::vector<std::string> Device::listGains(int direction, size_t) const {
    std::vector<std::string> names;
    for (const GainElement &one : elements(direction)) names.push_back(one.name);
    return names;
}

void Device::apply_gains(int direction) {
    const std::lock_guard lock(station_->mutex);
    double sum = 0;
    for (const auto &[name, db] : face(direction).gains) sum += db;
    tuned(direction).gain_db = sum;
    if (direction == SOAPY_SDR_TX) station_->retune();
}

void Device::setGain(int direction, size_t, const std::string &name, double db) {
    want_there();
    const GainElement &one = element(direction, name);
    if (db < 0 || db > one.max)
        throw std::invalid_argument("loopback: gain out of range: " + std::to_string(db));
    // The amplifier is on or off; the others step down.
    const double steps = one.step > 0 ? std::floor(db / one.step) * one.step : db;
    face(direction).gains[name] = one.step == one.max ? (db > 0 ? one.max : 0) : steps;
    apply_gains(direction);
}

// Shared out so that the amplifier comes last.
void Device::setGain(int direction, size_t channel, double db) {
    if (db < 0 || db > getGainRange(direction, channel).maximum())
        throw std::invalid_argument("loopback: gain out of range: " + std::to_string(db));
    for (const GainElement &one : elements(direction)) {
        const bool amplifier = one.step == one.max;
        const double share = amplifier && db < one.max ? 0 : std::min(db, one.max);
        setGain(direction, channel, one.name, share);
        db -= getGain(direction, channel, one.name);
    }
}

double Device::getGain(int direction, size_t) const { return tuned(direction).gain_db; }

double Device::getGain(int direction, size_t, const std::string &name) const {
    return face(direction).gains.at(element(direction, name).name);
}

SoapySDR::Range Device::getGainRange(int direction, size_t) const {
    double sum = 0;
    for (const GainElement &one : elements(direction)) sum += one.max;
    return {0, sum};
}

SoapySDR::Range Device::getGainRange(int direction, size_t, const std::string &name) const {
    const GainElement &one = element(direction, name);
    return {0, one.max, one.step};
}

}  // namespace loopback
