/* liquid-dsp's OFDM flex frames: 64 carriers, prefix 16, taper 4, CRC-32.
 *
 *   liquid errors CODE BITS BYTES SNR_DB FRAMES SEED    frames lost
 *   liquid headers SNR_DB FRAMES SEED                   frames whose header was read
 *   liquid speed CODE BITS BYTES                        Msps of CPU time: transmitter, receiver
 *   liquid noise SAMPLES SEED                           Msps of CPU time on noise, payloads told
 *   liquid send CODE BITS BYTES SEED FILE               writes a frame's samples
 *   liquid hear BYTES SEED FILE                         how many such frames are in samples
 *
 * SNR: mean power of the frame over that of the noise in the sample band. Every frame comes after
 * 200 to 599 samples of noise, its carrier off by up to 0.02 radians a sample either way.
 */
#include <complex.h>
#include <liquid/liquid.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CARRIERS = 64, PREFIX = 16, TAPER = 4, ROOM = 1 << 20, GAP = 400 };

static float complex wave[ROOM];
static unsigned char payload[2048];
static int size;
static long told, headers, right;
static uint64_t state;

static uint64_t draw(void)
{
    state += 0x9E3779B97F4A7C15u;
    uint64_t z = state;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

static double uniform(void) { return ((draw() >> 11) + 0.5) / 9007199254740992.0; }

static float complex gauss(double power)
{
    return sqrt(-power * log(uniform())) * cexp(2 * M_PI * I * uniform());
}

static double cpu_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int hear(unsigned char *header, int header_ok, unsigned char *data, unsigned int n,
                int data_ok, framesyncstats_s stats, void *context)
{
    (void)header, (void)stats, (void)context;
    headers += header_ok;
    told += header_ok && data_ok;
    right += header_ok && data_ok && (int)n == size && !memcmp(data, payload, n);
    return 0;
}

static ofdmflexframegen sender(const char *code, int bits)
{
    ofdmflexframegenprops_s props;
    ofdmflexframegenprops_init_default(&props);
    props.check = LIQUID_CRC_32;
    props.fec0 = liquid_getopt_str2fec(code);
    props.fec1 = LIQUID_FEC_NONE;
    props.mod_scheme = bits == 1 ? LIQUID_MODEM_BPSK : bits == 2 ? LIQUID_MODEM_QPSK
                     : bits == 4 ? LIQUID_MODEM_QAM16 : LIQUID_MODEM_QAM64;
    return ofdmflexframegen_create(CARRIERS, PREFIX, TAPER, NULL, &props);
}

static ofdmflexframesync receiver(void)
{
    return ofdmflexframesync_create(CARRIERS, PREFIX, TAPER, NULL, hear, NULL);
}

static int frame(ofdmflexframegen sends, float complex *to)
{
    unsigned char header[8] = {0};
    int n = 0, done = 0;
    ofdmflexframegen_assemble(sends, header, payload, size);
    for (; !done; n += CARRIERS + PREFIX)
        done = ofdmflexframegen_write(sends, to + n, CARRIERS + PREFIX);
    return n;
}

static double power(const float complex *x, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++) sum += crealf(x[i] * conjf(x[i]));
    return sum / n;
}

static void refill(void)
{
    for (int i = 0; i < size; i++) payload[i] = draw();
}

static void send_frames(const char *code, int bits, double snr_db, long frames)
{
    ofdmflexframegen sends = sender(code, bits);
    ofdmflexframesync hears = receiver();
    refill();
    double level = power(wave, frame(sends, wave)), noise = level * pow(10, -snr_db / 10);
    for (long f = 0; f < frames; f++) {
        refill();
        int lead = 200 + draw() % 400, n = lead + frame(sends, wave + lead);
        double step = 0.04 * (uniform() - 0.5), phase = 2 * M_PI * uniform();
        for (int i = 0; i < n + 160; i++)
            wave[i] = (i < lead || i >= n ? 0 : wave[i] * cexpf(I * (phase + step * (i - lead))))
                      + gauss(noise);
        ofdmflexframesync_execute(hears, wave, n + 160);
    }
    ofdmflexframegen_destroy(sends);
    ofdmflexframesync_destroy(hears);
}

static void measure_speed(const char *code, int bits)
{
    ofdmflexframegen sends = sender(code, bits);
    refill();
    int n = frame(sends, wave), rounds = 2000000 / n + 1, total = 0;
    double best_tx = 1e9, best_rx = 1e9;
    for (int round = 0; round < 5; round++) {
        double begin = cpu_s();
        for (int i = 0; i < rounds; i++) frame(sends, wave);
        double took = (cpu_s() - begin) / rounds;
        if (took < best_tx) best_tx = took;
    }
    double noise = power(wave, n) * 1e-3;
    for (; total + GAP + n < ROOM; total += n) {
        memset(wave + total, 0, GAP * sizeof *wave);
        total += GAP;
        frame(sends, wave + total);
    }
    for (int i = 0; i < total; i++) wave[i] += gauss(noise);
    for (int round = 0; round < 5; round++) {
        ofdmflexframesync hears = receiver();
        double begin = cpu_s();
        ofdmflexframesync_execute(hears, wave, total);
        double took = cpu_s() - begin;
        if (took < best_rx) best_rx = took;
        ofdmflexframesync_destroy(hears);
    }
    printf("%g %g\n", n / best_tx * 1e-6, total / best_rx * 1e-6);
    ofdmflexframegen_destroy(sends);
}

static void send_file(const char *code, int bits, const char *path)
{
    FILE *file = fopen(path, "wb");
    ofdmflexframegen sends = sender(code, bits);
    int n = frame(sends, wave);
    if (!file || fwrite(wave, sizeof *wave, n, file) != (size_t)n || fclose(file)) exit(1);
    ofdmflexframegen_destroy(sends);
}

static void hear_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    ofdmflexframesync hears = receiver();
    if (!file) exit(1);
    for (size_t n; (n = fread(wave, sizeof *wave, ROOM, file));)
        ofdmflexframesync_execute(hears, wave, n);
    fclose(file);
    ofdmflexframesync_destroy(hears);
    printf("%ld\n", right);
}

int main(int argc, char **argv)
{
    if (argc == 8 && !strcmp(argv[1], "errors")) {
        size = atoi(argv[4]), state = atoll(argv[7]);
        long frames = atol(argv[6]);
        send_frames(argv[2], atoi(argv[3]), atof(argv[5]), frames);
        printf("%ld\n", frames - right);
    } else if (argc == 5 && !strcmp(argv[1], "headers")) {
        size = 64, state = atoll(argv[4]);
        send_frames("none", 2, atof(argv[2]), atol(argv[3]));
        printf("%ld\n", headers);
    } else if (argc == 5 && !strcmp(argv[1], "speed")) {
        size = atoi(argv[4]);
        measure_speed(argv[2], atoi(argv[3]));
    } else if (argc == 4 && !strcmp(argv[1], "noise")) {
        state = atoll(argv[3]);
        for (int i = 0; i < ROOM; i++) wave[i] = gauss(1);
        ofdmflexframesync hears = receiver();
        double begin = cpu_s();
        long rounds = atol(argv[2]) / ROOM + 1;
        for (long i = 0; i < rounds; i++) ofdmflexframesync_execute(hears, wave, ROOM);
        printf("%g %ld\n", (double)rounds * ROOM / (cpu_s() - begin) * 1e-6, told);
        ofdmflexframesync_destroy(hears);
    } else if (argc == 7 && !strcmp(argv[1], "send")) {
        size = atoi(argv[4]), state = atoll(argv[5]);
        refill();
        send_file(argv[2], atoi(argv[3]), argv[6]);
    } else if (argc == 5 && !strcmp(argv[1], "hear")) {
        size = atoi(argv[2]), state = atoll(argv[3]);
        refill();
        hear_file(argv[4]);
    } else {
        return 2;
    }
    return 0;
}
