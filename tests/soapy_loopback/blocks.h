// Blocks as libhackrf sends them: one after the other while the transmitter is on, zeros when none
// is there; what does not fill one stays until more comes.
#pragma once
#include "sender.h"

namespace loopback {

class BlockSender : public Sender {
  public:
    using Sender::Sender;

    int write(const void *in, size_t n, int flags, long long time_ns, long timeout_us) override;
    int status(int &flags, long long &time_ns, long timeout_us) override;
    int64_t drained() const override { return next_ - in_flight(); }
    void forget() override;

  private:
    int64_t in_flight() const;
    bool has_room(int64_t now) const;
    void advance(int64_t now);
    void send_block(int64_t now);

    // The transmitter has been on since `origin_`; blocks are counted from there.
    int64_t origin_ = -1, next_ = 0, seen_ = 0, filled_ = 0;
    std::deque<int64_t> starts_;
    bool underflow_ = false;
};

}  // namespace loopback
