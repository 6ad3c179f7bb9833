#include "bus.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace loopback {
namespace {

// Byte `unit` of the file is locked by the device that is this unit; the kernel lets go of it
// when the process dies, however it dies.
flock unit_lock(int unit, short type) {
    flock lock{};
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    lock.l_start = unit;
    lock.l_len = 1;
    return lock;
}

int open_file(const std::string &name) {
    if (!name.empty()) {
        return shm_open(("/soapy-loopback-" + name).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    }
    static const int own = memfd_create("soapy-loopback", MFD_CLOEXEC);
    // Opened anew, since locks belong to what was opened.
    return open(("/proc/self/fd/" + std::to_string(own)).c_str(), O_RDWR | O_CLOEXEC);
}

[[noreturn]] void fail(const std::string &name, const char *why) {
    throw std::runtime_error("loopback bus '" + name + "': " + why);
}

}  // namespace

Bus::Bus(const std::string &name, double speed) : file_(open_file(name)), speed_(speed) {
    if (file_ < 0) fail(name, strerror(errno));
    struct stat info;
    fstat(file_, &info);
    const bool foreign = info.st_size != 0 && info.st_size != sizeof(Memory);
    const bool used = others();
    if (foreign && used) fail(name, "is in use by another version of this driver");
    if (foreign && ftruncate(file_, 0) != 0) fail(name, strerror(errno));
    if (info.st_size != sizeof(Memory) && ftruncate(file_, sizeof(Memory)) != 0)
        fail(name, strerror(errno));
    void *memory = mmap(nullptr, sizeof(Memory), PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
    if (memory == MAP_FAILED) fail(name, strerror(errno));
    memory_ = static_cast<Memory *>(memory);
    if (memory_->header.version.exchange(VERSION) != VERSION || !used)
        memory_->header.speed = speed;
    if (memory_->header.speed != speed) fail(name, "runs at another speed");
}

Bus::~Bus() {
    munmap(memory_, sizeof(Memory));
    close(file_);
}

bool Bus::others() const {
    flock lock = unit_lock(0, F_WRLCK);
    lock.l_len = UNITS;
    return fcntl(file_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

void Bus::claim(int unit) {
    flock lock = unit_lock(unit, F_WRLCK);
    if (fcntl(file_, F_OFD_SETLK, &lock) != 0)
        throw std::runtime_error("loopback: unit " + std::to_string(unit) + " is in use");
}

int64_t Bus::air_ns() const {
    const int64_t now = monotonic_ns();
    return speed_ == 1 ? now : std::llround(now * static_cast<long double>(speed_));
}

int64_t Bus::monotonic(int64_t air_ns) const {
    return speed_ == 1 ? air_ns : std::llround(air_ns / static_cast<long double>(speed_));
}

void inject(Control &control, const std::string &fault) {
    const size_t equals = fault.find('=');
    const std::string name = fault.substr(0, equals);
    const long long count = equals == std::string::npos ? 1 : std::stoll(fault.substr(equals + 1));
    if (name == "unplug") {
        control.unplugs++;
        control.unplugged = 1;
    } else if (name == "replug") {
        control.unplugged = 0;
    } else if (name == "overflow") {
        control.lose = equals == std::string::npos ? 10000 : count;
    } else if (name == "underflow") {
        control.underflow = count;
    } else if (name == "time_error") {
        control.time_error = count;
    } else if (name == "stall") {
        control.stall = 1;
    } else if (name == "crash") {
        control.crash = 1;
    } else if (name == "hang") {
        control.hang = 1;
    } else {
        throw std::invalid_argument("loopback: unknown fault '" + name + "'");
    }
}

}  // namespace loopback
