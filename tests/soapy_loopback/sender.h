// A transmit stream. Two kinds: bursts that begin and end, and blocks that leave only when full.
#pragma once
#include <deque>

#include "station.h"

namespace loopback {

class Sender {
  public:
    Sender(Station &station, Format format) : station_(station), format_(format) {}
    virtual ~Sender() = default;

    virtual int write(const void *in, size_t n, int flags, long long time_ns, long timeout_us) = 0;
    virtual int status(int &flags, long long &time_ns, long timeout_us) = 0;
    // When the last sample queued has left: the index after it. Wants the station's mutex held.
    virtual int64_t drained() const = 0;
    // What was queued is off the air. Wants the station's mutex held.
    virtual void forget() = 0;

  protected:
    Station &station_;
    const Format format_;
};

}  // namespace loopback
