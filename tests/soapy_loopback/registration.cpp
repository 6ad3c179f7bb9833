#include <SoapySDR/Registry.hpp>
#include <stdexcept>

#include "device.h"

namespace loopback {
namespace {

// Nobody who looks for a radio shall find this one by chance.
SoapySDR::KwargsList find(const SoapySDR::Kwargs &args) {
    const auto driver = args.find("driver");
    if (driver == args.end() || driver->second != "loopback") return {};
    SoapySDR::Kwargs given = args;
    const auto serial = given.find("serial");
    if (serial != given.end() && given.count("unit") == 0 && serial->second.rfind("LB", 0) == 0)
        given["unit"] = serial->second.substr(2);
    const Settings settings(given);
    if (settings.absent || (serial != given.end() && serial->second != settings.serial)) return {};
    if (Bus(settings.bus, settings.speed).unit(settings.unit).control.unplugged) return {};
    SoapySDR::Kwargs found = given;
    found["serial"] = settings.serial;
    found["unit"] = std::to_string(settings.unit);
    found["label"] = "loopback " + settings.model->name + " " + settings.serial;
    return {found};
}

SoapySDR::Device *make(const SoapySDR::Kwargs &args) {
    const auto found = find(args);
    if (found.empty()) throw std::runtime_error("no loopback device matches");
    const Settings settings(found.front());
    if (settings.busy)
        throw std::runtime_error("loopback: unit " + std::to_string(settings.unit) + " is in use");
    return new Device(settings);
}

const SoapySDR::Registry registration("loopback", find, make, SOAPY_SDR_ABI_VERSION);

}  // namespace
}  // namespace loopback
