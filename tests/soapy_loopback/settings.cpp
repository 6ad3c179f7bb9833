#include "settings.h"

#include <map>
#include <stdexcept>

#include "layout.h"

namespace loopback {
namespace {

const std::map<std::string, Model> MODELS = {
    {"plain",
     {"plain", {"RX"}, {"TX"}, {{"PGA", 60, 0, 20}}, {{"PGA", 60, 0, 40}}, 0, 10e9, "CF32", 1}},
    {"usrp",
     {"usrp",
      {"TX/RX", "RX2"},
      {"TX/RX"},
      {{"PGA", 76, 1, 0}},
      {{"PGA", 89, 0.25, 0}},
      50e6,
      6e9,
      "CS16",
      32768}},
    {"hackrf",
     {"hackrf",
      {"TX/RX"},
      {"TX/RX"},
      {{"LNA", 40, 8, 16}, {"VGA", 62, 2, 16}, {"AMP", 14, 14, 0}},
      {{"VGA", 47, 1, 0}, {"AMP", 14, 14, 0}},
      1e6,
      6e9,
      "CS8",
      128}},
};

// Text, as SoapySDR has it; what a model does not say is as in the plain one.
struct Default {
    const char *key, *value;
};
constexpr Default PLAIN[] = {
    {"unit", "0"},       {"bus", ""},          {"duplex", "full"},  {"mtu", "4096"},
    {"fill", "no"},      {"time", "yes"},      {"ack", "yes"},      {"status", "yes"},
    {"late", "status"},
    {"rxblock", "1024"}, {"txblock", "1"},     {"rxbuf", "262144"}, {"txbuf", "262144"},
    {"inflight", "0"},   {"txlat_us", "1000"}, {"turn_us", "1000"}, {"bits", "16"},
    {"speed", "1"},      {"noise_db", "-80"},  {"loss_db", "0"},    {"leak_db", "-200"},
    {"cfo", "0"},        {"ppm", "0"},         {"delay", "0"},      {"dc", "0"},
    {"self", "no"},      {"min_rate", "1"},    {"max_rate", "1e9"}, {"rate_error", "0"},
    {"lie", "yes"},      {"busy", "no"},       {"absent", "no"},
};
constexpr Default USRP[] = {
    {"mtu", "2040"}, {"fill", "yes"},     {"rxblock", "2040"},   {"txbuf", "65536"},
    {"bits", "12"},  {"noise_db", "-70"}, {"min_rate", "200e3"}, {"max_rate", "61.44e6"},
};
constexpr Default HACKRF[] = {
    {"duplex", "half"},   {"mtu", "131072"},     {"time", "no"},       {"ack", "no"},
    {"status", "no"},     {"rxblock", "131072"}, {"txblock", "131072"}, {"rxbuf", "1966080"},
    {"txbuf", "1966080"}, {"txlat_us", "5000"},  {"turn_us", "20000"}, {"bits", "8"},
    {"noise_db", "-45"},  {"leak_db", "-45"},    {"dc", "0.02"},       {"min_rate", "2e6"},
    {"max_rate", "20e6"},
};

const Model *find_model(const SoapySDR::Kwargs &args) {
    const auto given = args.find("model");
    const auto found = MODELS.find(given == args.end() ? "plain" : given->second);
    if (found == MODELS.end())
        throw std::invalid_argument("loopback: no model '" + given->second + "'");
    return &found->second;
}

struct Reader {
    SoapySDR::Kwargs values;

    template <size_t N>
    void otherwise(const Default (&defaults)[N]) {
        for (const Default &one : defaults) values.emplace(one.key, one.value);
    }
    const std::string &text(const std::string &key) const { return values.at(key); }
    double number(const std::string &key) const {
        size_t used = 0;
        double value = 0;
        try {
            value = std::stod(text(key), &used);
        } catch (const std::exception &) {
        }
        if (used == 0 || used != text(key).size())
            throw std::invalid_argument("loopback: " + key + " is no number: " + text(key));
        return value;
    }
    double between(const std::string &key, double low, double high) const {
        const double value = number(key);
        if (value < low || value > high)
            throw std::invalid_argument("loopback: " + key + " is out of range: " + text(key));
        return value;
    }
    bool flag(const std::string &key) const {
        const std::string &value = text(key);
        return value == "yes" || value == "true" || value == "1" || value == "on";
    }
};

}  // namespace

Settings::Settings(const SoapySDR::Kwargs &args) : model(find_model(args)) {
    Reader given{args};
    if (model->name == "usrp") given.otherwise(USRP);
    if (model->name == "hackrf") given.otherwise(HACKRF);
    given.otherwise(PLAIN);

    keeps_newest = model->name == "hackrf";
    bus = given.text("bus");
    unit = given.between("unit", 0, UNITS - 1);
    serial = "LB" + std::to_string(unit);
    half_duplex = given.text("duplex") == "half";
    fill = given.flag("fill");
    time = given.flag("time");
    ack = given.flag("ack");
    status = given.flag("status");
    late_return = given.text("late") == "return";
    self = given.flag("self");
    lie = given.flag("lie");
    busy = given.flag("busy");
    absent = given.flag("absent");
    mtu = given.between("mtu", 1, MAX_QUEUE);
    rx_block = given.between("rxblock", 1, MAX_QUEUE);
    tx_block = given.between("txblock", 1, MAX_QUEUE);
    rx_buffer = given.between("rxbuf", 1, MAX_QUEUE);
    tx_buffer = given.between("txbuf", tx_block, MAX_QUEUE);
    in_flight = given.between("inflight", 0, 64);
    bits = given.between("bits", 2, 16);
    tx_latency_s = given.between("txlat_us", 0, 60e6) / 1e6;
    turnaround_s = given.between("turn_us", 0, 60e6) / 1e6;
    speed = given.between("speed", 1e-4, 1e4);
    noise_db = given.number("noise_db");
    loss_db = given.number("loss_db");
    leak_db = given.number("leak_db");
    cfo = given.number("cfo");
    ppm = given.between("ppm", -1e4, 1e4);
    dc = given.number("dc");
    delay = given.between("delay", 0, MAX_QUEUE / 2);
    min_rate = given.number("min_rate");
    max_rate = given.number("max_rate");
    rate_error = given.between("rate_error", -0.5, 1);
}

bool Settings::set(const std::string &key, const std::string &value) {
    const Reader given{{{key, value}}};
    if (key == "noise_db") noise_db = given.number(key);
    else if (key == "loss_db") loss_db = given.number(key);
    else if (key == "leak_db") leak_db = given.number(key);
    else if (key == "cfo") cfo = given.number(key);
    else if (key == "ppm") ppm = given.between(key, -1e4, 1e4);
    else if (key == "delay") delay = given.between(key, 0, MAX_QUEUE / 2);
    else if (key == "dc") dc = given.number(key);
    else if (key == "self") self = given.flag(key);
    else return false;
    return true;
}

std::string Settings::get(const std::string &key) const {
    const std::map<std::string, double> values = {
        {"noise_db", noise_db}, {"loss_db", loss_db}, {"leak_db", leak_db}, {"cfo", cfo},
        {"ppm", ppm},           {"delay", delay},     {"dc", dc},           {"self", self},
    };
    const auto found = values.find(key);
    if (found == values.end()) throw std::invalid_argument("loopback: no setting '" + key + "'");
    return std::to_string(found->second);
}

}  // namespace loopback
