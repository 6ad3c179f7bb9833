// Bursts as a USRP sends them: at their time, to their last sample, and told of.
#pragma once
#include "sender.h"

namespace loopback {

class BurstSender : public Sender {
  public:
    using Sender::Sender;

    int write(const void *in, size_t n, int flags, long long time_ns, long timeout_us) override;
    int status(int &flags, long long &time_ns, long timeout_us) override;
    int64_t drained() const override { return end_; }
    void forget() override;

  private:
    struct Span {
        int64_t start, end;
    };
    struct Event {
        int code, flags;
        int64_t index;
    };

    void cut(int64_t now);
    void advance(int64_t now);
    int64_t queued(int64_t now);
    bool refuse();
    bool place(bool timed, long long time_ns, int64_t now, int64_t &start);
    int64_t take(const void *in, int64_t n, bool timed, long long time_ns, int64_t now);
    void end_burst();
    void tell(int code, int flags, int64_t index);

    std::deque<Span> spans_;
    std::deque<Event> events_;
    bool in_burst_ = false, starved_ = false, dropping_ = false;
    int64_t end_ = 0;
};

}  // namespace loopback
