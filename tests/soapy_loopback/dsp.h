// Loops over samples. Samples between these are planar floats at ±1 full scale.
#pragma once
#include <cstddef>
#include <cstdint>

namespace loopback {

constexpr int TAPS = 32;

enum class Format { CF32, CS16, CS8 };
size_t bytes(Format format);

// To interleaved 16 bit, rounded to the converter's `bits` and saturated.
void to_ring(const void *in, Format format, int bits, int16_t *out, size_t n);
void from_ring(const int16_t *in, float gain, float *re, float *im, size_t n);

void fill(float *out, float value, size_t n);
void add(const float *in, float *out, size_t n);
// Times e^(j 2 pi (phase + step i)); both in cycles.
void rotate(float *re, float *im, double phase, double step, size_t n);
// out[i] += in at position i * step + fraction, of which in[TAPS / 2 - 1] is 0. Reads up to
// 2 TAPS beyond the last of these.
void resample_add(const float *re, const float *im, double fraction, double step, float *out_re,
                  float *out_im, size_t n);
// Gaussian, of standard deviation `rms` over both parts together.
void add_noise(float *re, float *im, float rms, uint64_t &seed, size_t n);
// What an analogue-to-digital converter of so many bits makes of it.
void from_planar(const float *re, const float *im, int bits, Format format, void *out, size_t n);

}  // namespace loopback
