// Sine, cosine, arc tangent, exponential and logarithm from additions, products, quotients and square roots alone,
// whose result IEEE 754 defines to the bit: the same result on every processor, with every library and build. The C
// library's functions differ in the last bit, depending on the instructions available. Argument reduction after Cody
// and Waite (1980), then Taylor polynomials, summed with the lower part of the argument. Errors against exact values:
// tests/onboard/native/test_elementary.py.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace eldorado {
namespace elementary {

constexpr double kPi = 0x1.921fb54442d18p+1, kPiLow = 0x1.1a62633145c07p-53;
constexpr double kHalf1 = 0x1.921fb54400000p+0, kHalf2 = 0x1.0b4611a600000p-34, kHalf3 = 0x1.3198a2e037073p-69;  // pi/2
constexpr double kLn2 = 0x1.62e42fefa2000p-1, kLn2Low = 0x1.9ef35793c7673p-41;
constexpr double kFarthest = 1e6;  // rad: up to here a multiple of pi/2 is subtracted exactly
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// An angle within pi/4 of a multiple of pi/2: number of the multiple (modulo 4), and the rest in two parts.
struct Reduced {
    int quarter;
    double high, low;
};

inline Reduced reduced(double x) {
    if (std::abs(x) > kFarthest) x = std::fmod(x, 2.0 * kPi);  // exact, but 2 pi is not
    const double n = std::nearbyint(x * (2.0 / kPi));
    const double first = x - n * kHalf1;  // both exact
    const double second = n * kHalf2;     // exact
    const double high = first - second;
    const double lost = (first - high) - second;  // rounding error of that difference
    const double third = n * kHalf3 - lost;
    const double sum = high - third;
    return {static_cast<int>(static_cast<std::int64_t>(n) & 3), sum, (high - sum) - third};
}

inline double sine(double r, double low) {
    const double s = r * r;
    double p = 1.0 / 355687428096000.0;  // 17!
    p = p * s - 1.0 / 1307674368000.0;
    p = p * s + 1.0 / 6227020800.0;
    p = p * s - 1.0 / 39916800.0;
    p = p * s + 1.0 / 362880.0;
    p = p * s - 1.0 / 5040.0;
    p = p * s + 1.0 / 120.0;
    p = p * s - 1.0 / 6.0;
    return r + (r * s * p + low * (1.0 - 0.5 * s));
}

inline double cosine(double r, double low) {
    const double s = r * r;
    double p = 1.0 / 20922789888000.0;  // 16!
    p = p * s - 1.0 / 87178291200.0;
    p = p * s + 1.0 / 479001600.0;
    p = p * s - 1.0 / 3628800.0;
    p = p * s + 1.0 / 40320.0;
    p = p * s - 1.0 / 720.0;
    p = p * s + 1.0 / 24.0;
    const double half = 0.5 * s, near = 1.0 - half;
    return near + (((1.0 - near) - half) + (s * s * p - r * low));
}

inline double sin(double x) {
    if (!(std::abs(x) < kInf)) return kNan;
    const Reduced at = reduced(x);
    if (x == 0.0) return x;
    const double value = at.quarter & 1 ? cosine(at.high, at.low) : sine(at.high, at.low);
    return at.quarter & 2 ? -value : value;
}

inline double cos(double x) {
    if (!(std::abs(x) < kInf)) return kNan;
    const Reduced at = reduced(x);
    const double value = at.quarter & 1 ? sine(at.high, at.low) : cosine(at.high, at.low);
    return (at.quarter + 1) & 2 ? -value : value;
}

inline double tan(double x) { return x == 0.0 ? x : sin(x) / cos(x); }

constexpr double kAtan[17][2] = {  // of k/16, in two parts
    {0x0.0p+0, 0x0.0p+0},
    {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.0657e94db30d0p-1, -0x1.d5b495f6349e6p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

// The angle of (larger, smaller), both >= 0 and not both 0, in [0, pi/4]: high part, and the correction to add.
inline void first_octant(double smaller, double larger, double& high, double& low) {
    const double ratio = smaller / larger;
    const int k = static_cast<int>(std::nearbyint(16.0 * ratio));
    const double c = k / 16.0;
    double top;
    std::memcpy(&top, &larger, sizeof top);
    std::uint64_t bits;
    std::memcpy(&bits, &larger, sizeof bits);
    bits &= ~std::uint64_t{0x3ffffff};  // 27 bits: the product with c is exact
    std::memcpy(&top, &bits, sizeof top);
    const double rise = (smaller - c * top) - c * (larger - top);
    const double t = k == 0 ? ratio : rise / (larger + c * smaller);
    const double s = t * t;
    double p = -1.0 / 15.0;
    p = p * s + 1.0 / 13.0;
    p = p * s - 1.0 / 11.0;
    p = p * s + 1.0 / 9.0;
    p = p * s - 1.0 / 7.0;
    p = p * s + 1.0 / 5.0;
    p = p * s - 1.0 / 3.0;
    high = kAtan[k][0];
    low = kAtan[k][1] + (t + t * s * p);
}

inline double atan2(double y, double x) {
    if (std::isnan(x) || std::isnan(y)) return kNan;
    const double across = std::abs(y), along = std::abs(x);
    double high = 0.0, low = 0.0;
    if (across == kInf && along == kInf) {
        high = kAtan[16][0];
    } else if (across != 0.0 || along != 0.0) {
        if (across <= along) {
            first_octant(across, along, high, low);
        } else {
            first_octant(along, across, high, low);
            const double rest = 0.5 * kPi - high;
            low = ((0.5 * kPi - rest) - high) + 0.5 * kPiLow - low;
            high = rest;
        }
    }
    if (std::signbit(x)) {
        const double turned = kPi - high;
        low = ((kPi - turned) - high) + kPiLow - low;
        high = turned;
    }
    return std::copysign(high + low, y);
}

inline double atan(double x) { return atan2(x, 1.0); }
inline double asin(double x) { return atan2(x, std::sqrt((1.0 - x) * (1.0 + x))); }
inline double acos(double x) { return atan2(std::sqrt((1.0 - x) * (1.0 + x)), x); }

// Length of (x, y); squares beyond 1e308 overflow.
inline double hypot(double x, double y) { return std::sqrt(x * x + y * y); }

inline double exp(double x) {
    if (std::isnan(x)) return kNan;
    if (x > 709.8) return kInf;
    if (x < -745.2) return 0.0;
    const double n = std::nearbyint(x * (1.0 / (kLn2 + kLn2Low)));
    const double first = x - n * kLn2;  // exact
    const double r = first - n * kLn2Low, low = (first - r) - n * kLn2Low;
    double p = 1.0 / 6227020800.0;  // 13!
    p = p * r + 1.0 / 479001600.0;
    p = p * r + 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = p * r + 0.5;
    return std::ldexp(1.0 + (r + (r * r * p + low)), static_cast<int>(n));
}

inline double log(double x) {
    if (std::isnan(x) || x < 0.0) return kNan;
    if (x == 0.0) return -kInf;
    if (x == kInf) return kInf;
    int n;
    double m = std::frexp(x, &n);  // [0.5, 1)
    if (m < 0.70710678118654752440) {
        m *= 2.0;
        --n;
    }
    const double f = m - 1.0, s = f / (2.0 + f), z = s * s;
    double p = 2.0 / 23.0;
    for (int k = 21; k >= 3; k -= 2) p = p * z + 2.0 / k;
    // log m = f - s * (f - r) with r = z * p, which loses no digits where m is near 1
    const double r = z * p;
    return n * kLn2 + (f + (n * kLn2Low - s * (f - r)));
}

}  // namespace elementary
}  // namespace eldorado
