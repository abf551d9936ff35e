// Vectors as wide as the instruction set of this build: 4, 8 or 16 floats (gcc vector extensions).
#pragma once

#include <cstdint>
#include <cstring>

namespace eldorado {

#if defined(__AVX512F__)
constexpr int kLanes = 16;
#elif defined(__AVX2__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif

typedef float Floats __attribute__((vector_size(4 * kLanes)));
typedef std::int32_t Ints __attribute__((vector_size(4 * kLanes)));  // also the result of a comparison: 0 or -1

constexpr int kPairs = kLanes / 2;
typedef double Doubles __attribute__((vector_size(8 * kPairs)));
typedef std::int64_t Longs __attribute__((vector_size(8 * kPairs)));  // also the result of a comparison of doubles

inline Floats all(float value) { return value - Floats{}; }
inline Ints all(std::int32_t value) { return value - Ints{}; }

inline Floats load(const float* from) {
    Floats value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

inline Doubles load(const double* from) {
    Doubles value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

inline Ints load(const std::int32_t* from) {
    Ints value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

inline void store(std::int32_t* to, Ints value) { std::memcpy(to, &value, sizeof value); }
inline void store(double* to, Doubles value) { std::memcpy(to, &value, sizeof value); }

inline Floats larger(Floats a, Floats b) { return a > b ? a : b; }
inline Floats smaller(Floats a, Floats b) { return a < b ? a : b; }

inline bool any(Ints mask) {
    std::int64_t pairs[kPairs], found = 0;
    std::memcpy(pairs, &mask, sizeof pairs);
    for (const std::int64_t pair : pairs) found |= pair;
    return found != 0;
}

}  // namespace eldorado
