// A receive stream: samples come as time passes, and are lost when nobody fetches them.
#pragma once
#include <vector>

#include "station.h"

namespace loopback {

class Receiver {
  public:
    Receiver(Station &station, Format format);

    // From this index on, `count` samples or for ever (0); the first `wrong` of them garbage.
    void start(int64_t index, int64_t count = 0, int64_t wrong = 0);
    // For a start that was asked for too late: told by the next read.
    void fail();
    void stop();
    int read(void *out, size_t n, int &flags, long long &time_ns, long timeout_us);

  private:
    int64_t available();
    int overflow(int &flags, long long &time_ns);
    void render(void *out, int64_t n);
    void render_block(void *out, size_t n, const Listener &listener);
    void obey_faults();
    void lose_samples();
    long long stamp(int64_t index) const;

    Station &station_;
    const Format format_;
    std::mutex mutex_;
    Ear ear_;
    std::vector<float> re_, im_;
    uint64_t seed_;
    bool active_ = false;
    std::atomic<bool> failed_{false};
    double rate_ = 0;
    int64_t origin_ = 0, next_ = 0, last_ = 0, clean_ = 0;
    // From here on samples are lost; -1: none are.
    int64_t lost_from_ = -1, lost_until_ = -1;
};

}  // namespace loopback
