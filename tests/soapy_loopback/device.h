// The test radio as SoapySDR sees it.
#pragma once
#include <SoapySDR/Device.hpp>
#include <map>
#include <memory>

#include "receiver.h"
#include "sender.h"

namespace loopback {

class Device : public SoapySDR::Device {
  public:
    explicit Device(const Settings &settings);
    ~Device() override;

    std::string getDriverKey() const override { return "loopback"; }
    std::string getHardwareKey() const override;
    SoapySDR::Kwargs getHardwareInfo() const override;
    size_t getNumChannels(int) const override { return 1; }
    bool getFullDuplex(int, size_t) const override;

    std::vector<std::string> getStreamFormats(int, size_t) const override;
    std::string getNativeStreamFormat(int, size_t, double &full_scale) const override;
    SoapySDR::Stream *setupStream(int direction, const std::string &format,
                                  const std::vector<size_t> &channels,
                                  const SoapySDR::Kwargs &args) override;
    void closeStream(SoapySDR::Stream *stream) override;
    size_t getStreamMTU(SoapySDR::Stream *stream) const override;
    int activateStream(SoapySDR::Stream *stream, int flags, long long time_ns,
                       size_t count) override;
    int deactivateStream(SoapySDR::Stream *stream, int flags, long long time_ns) override;
    int readStream(SoapySDR::Stream *stream, void *const *buffers, size_t n, int &flags,
                   long long &time_ns, long timeout_us) override;
    int writeStream(SoapySDR::Stream *stream, const void *const *buffers, size_t n, int &flags,
                    long long time_ns, long timeout_us) override;
    int readStreamStatus(SoapySDR::Stream *stream, size_t &channels, int &flags,
                         long long &time_ns, long timeout_us) override;

    std::vector<std::string> listAntennas(int direction, size_t) const override;
    void setAntenna(int direction, size_t, const std::string &name) override;
    std::string getAntenna(int direction, size_t) const override;

    std::vector<std::string> listGains(int direction, size_t) const override;
    void setGain(int direction, size_t, double db) override;
    void setGain(int direction, size_t, const std::string &name, double db) override;
    double getGain(int direction, size_t) const override;
    double getGain(int direction, size_t, const std::string &name) const override;
    SoapySDR::Range getGainRange(int direction, size_t) const override;
    SoapySDR::Range getGainRange(int direction, size_t, const std::string &name) const override;

    std::vector<std::string> listFrequencies(int, size_t) const override { return {"RF"}; }
    void setFrequency(int direction, size_t, double hz, const SoapySDR::Kwargs &) override;
    void setFrequency(int direction, size_t, const std::string &name, double hz,
                      const SoapySDR::Kwargs &) override;
    double getFrequency(int direction, size_t) const override;
    double getFrequency(int direction, size_t, const std::string &name) const override;
    SoapySDR::RangeList getFrequencyRange(int, size_t) const override;
    SoapySDR::RangeList getFrequencyRange(int, size_t, const std::string &name) const override;

    void setSampleRate(int direction, size_t, double hz) override;
    double getSampleRate(int direction, size_t) const override;
    SoapySDR::RangeList getSampleRateRange(int, size_t) const override;
    void setBandwidth(int direction, size_t, double hz) override;
    double getBandwidth(int direction, size_t) const override;

    bool hasHardwareTime(const std::string &) const override;
    long long getHardwareTime(const std::string &) const override;
    void setHardwareTime(long long time_ns, const std::string &) override;

    void writeSetting(const std::string &key, const std::string &value) override;
    std::string readSetting(const std::string &key) const override;

  private:
    // What an application may set per direction.
    struct Face {
        std::string antenna;
        std::map<std::string, double> gains;
        double asked_rate, bandwidth = 0;
    };

    void want_there() const;
    Face &face(int direction) { return faces_[direction]; }
    const Face &face(int direction) const { return faces_[direction]; }
    const std::vector<GainElement> &elements(int direction) const;
    const GainElement &element(int direction, const std::string &name) const;
    Tuned &tuned(int direction) const;
    void apply_gains(int direction);
    int to_receive(long timeout_us);
    void stop_sending();

    std::unique_ptr<Station> station_;
    const Model &model_;
    Face faces_[2];
    std::unique_ptr<Receiver> receiver_;
    std::unique_ptr<Sender> sender_;
};

}  // namespace loopback
