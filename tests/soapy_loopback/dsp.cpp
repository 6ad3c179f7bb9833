#include "dsp.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace loopback {
namespace {

constexpr int ROTATED = 64;
constexpr int PHASES = 1024;
constexpr int RUN = 16;
typedef float Run __attribute__((vector_size(RUN * sizeof(float)), aligned(4), may_alias));
constexpr double KAISER = 6;
constexpr size_t NOISE = 1 << 16, NOISE_RUN = 512;

float saturated(float value, float peak) { return std::min(std::max(value, -peak - 1), peak); }

// Shifts by a fraction of a sample; flat up to 0.4 of the rate.
struct Filters {
    float tap[PHASES + 1][TAPS];

    Filters() {
        for (int phase = 0; phase <= PHASES; phase++) {
            double sum = 0;
            for (int k = 0; k < TAPS; k++) {
                const double x = k - (TAPS / 2 - 1) - double(phase) / PHASES;
                const double edge = std::max(0.0, 1 - std::pow(x / (TAPS / 2), 2));
                const double window = std::cyl_bessel_i(0, KAISER * std::sqrt(edge));
                const double sinc = std::fabs(x) < 1e-12 ? 1 : std::sin(M_PI * x) / (M_PI * x);
                sum += tap[phase][k] = window * sinc;
            }
            for (float &value : tap[phase]) value /= sum;
        }
    }
};

std::vector<float> make_noise() {
    std::mt19937 random(1);
    std::normal_distribution<float> normal(0, std::sqrt(0.5F));
    std::vector<float> noise(NOISE + NOISE_RUN);
    for (float &value : noise) value = normal(random);
    return noise;
}

}  // namespace

size_t bytes(Format format) {
    return format == Format::CF32 ? 8 : format == Format::CS16 ? 4 : 2;
}

void to_ring(const void *in, Format format, int bits, int16_t *out, size_t n) {
    const float peak = float((1 << (bits - 1)) - 1);
    const int unit = 1 << (16 - bits);
    auto convert = [&](auto *values, float scale) {
        for (size_t i = 0; i < 2 * n; i++) {
            const float level = saturated(values[i] * scale * (peak + 1), peak);
            out[i] = int16_t(int(std::nearbyint(level)) * unit);
        }
    };
    if (format == Format::CF32) convert(static_cast<const float *>(in), 1.0F);
    if (format == Format::CS16) convert(static_cast<const int16_t *>(in), 1 / 32768.0F);
    if (format == Format::CS8) convert(static_cast<const int8_t *>(in), 1 / 128.0F);
}

void from_ring(const int16_t *in, float gain, float *re, float *im, size_t n) {
    const float scale = gain / 32768;
    for (size_t i = 0; i < n; i++) {
        re[i] = scale * in[2 * i];
        im[i] = scale * in[2 * i + 1];
    }
}

void fill(float *out, float value, size_t n) {
    for (size_t i = 0; i < n; i++) out[i] = value;
}

void add(const float *in, float *out, size_t n) {
    for (size_t i = 0; i < n; i++) out[i] += in[i];
}

void rotate(float *re, float *im, double phase, double step, size_t n) {
    float c[ROTATED], s[ROTATED];
    for (int i = 0; i < ROTATED; i++) {
        c[i] = std::cos(2 * M_PI * step * i);
        s[i] = std::sin(2 * M_PI * step * i);
    }
    for (size_t at = 0; at < n; at += ROTATED) {
        const double angle = 2 * M_PI * (phase + step * at);
        const float zc = std::cos(angle), zs = std::sin(angle);
        const size_t run = std::min<size_t>(ROTATED, n - at);
        for (size_t i = 0; i < run; i++) {
            const float wc = zc * c[i] - zs * s[i], ws = zc * s[i] + zs * c[i];
            const float x = re[at + i], y = im[at + i];
            re[at + i] = x * wc - y * ws;
            im[at + i] = x * ws + y * wc;
        }
    }
}

void resample_add(const float *re, const float *im, double fraction, double step, float *out_re,
                  float *out_im, size_t n) {
    static const Filters filters;
    const double drift = std::fabs(step - 1) * PHASES;
    // So many samples in a row take the same filter.
    const size_t same = drift * RUN < 1 ? RUN : std::max<size_t>(1, size_t(1 / drift));
    for (size_t at = 0; at < n; at += same) {
        const double position = fraction + step * at;
        const auto whole = static_cast<size_t>(position);
        const float *tap = filters.tap[int((position - whole) * PHASES + 0.5)];
        Run x = {}, y = {};
        for (int k = 0; k < TAPS; k++) {
            x += tap[k] * *reinterpret_cast<const Run *>(re + whole + k);
            y += tap[k] * *reinterpret_cast<const Run *>(im + whole + k);
        }
        const size_t count = std::min(same, n - at);
        for (size_t i = 0; i < count; i++) {
            out_re[at + i] += x[i];
            out_im[at + i] += y[i];
        }
    }
}

void add_noise(float *re, float *im, float rms, uint64_t &seed, size_t n) {
    static const std::vector<float> noise = make_noise();
    for (size_t at = 0; at < n; at += NOISE_RUN) {
        seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
        const float *a = &noise[(seed >> 33) % NOISE], *b = &noise[(seed >> 17) % NOISE];
        const size_t run = std::min(NOISE_RUN, n - at);
        for (size_t i = 0; i < run; i++) {
            re[at + i] += rms * a[i];
            im[at + i] += rms * b[i];
        }
    }
}

void from_planar(const float *re, const float *im, int bits, Format format, void *out, size_t n) {
    if (format == Format::CS8) bits = std::min(bits, 8);
    const float peak = float((1 << (bits - 1)) - 1);
    auto convert = [&](auto *values, float scale) {
        using Value = std::remove_pointer_t<decltype(values)>;
        for (size_t i = 0; i < n; i++) {
            const float x = saturated(re[i] * (peak + 1), peak);
            const float y = saturated(im[i] * (peak + 1), peak);
            values[2 * i] = Value(std::nearbyint(x) * scale);
            values[2 * i + 1] = Value(std::nearbyint(y) * scale);
        }
    };
    if (format == Format::CF32) convert(static_cast<float *>(out), 1 / (peak + 1));
    if (format == Format::CS16) convert(static_cast<int16_t *>(out), 32768 / (peak + 1));
    if (format == Format::CS8) convert(static_cast<int8_t *>(out), 128 / (peak + 1));
}

}  // namespace loopback
