// The shared memory of a bus, mapped; and the right to be one of its units.
#pragma once
#include <string>

#include "layout.h"

namespace loopback {

class Bus {
  public:
    // An empty name is a bus of this process alone. Throws std::runtime_error.
    Bus(const std::string &name, double speed);
    ~Bus();
    Bus(const Bus &) = delete;
    Bus &operator=(const Bus &) = delete;

    // Throws when another device is this unit.
    void claim(int unit);

    Unit &unit(int number) { return memory_->unit[number]; }
    const Unit &unit(int number) const { return memory_->unit[number]; }
    int64_t air_ns() const;
    int64_t monotonic(int64_t air_ns) const;
    double speed() const { return speed_; }

  private:
    bool others() const;

    int file_;
    double speed_;
    Memory *memory_;
};

// Does to a unit what a fault's name says: "unplug", "overflow=5000", … Throws on unknown names.
void inject(Control &control, const std::string &fault);

}  // namespace loopback
