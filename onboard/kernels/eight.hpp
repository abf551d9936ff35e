// Eight lanes of 32 bits: one register with AVX2, two without. All variants give the same bits.
#pragma once

#include <cstdint>

namespace eldorado {

#if defined(__AVX2__)
constexpr int kEightParts = 1;
#else
constexpr int kEightParts = 2;
#endif
constexpr int kEightSize = 8 / kEightParts;  // lanes of a part

template <typename T>
struct Eight {
    typedef T Part __attribute__((vector_size(4 * kEightSize)));
    Part part[kEightParts];

    T& operator[](int lane) { return reinterpret_cast<T*>(part)[lane]; }
    T operator[](int lane) const { return reinterpret_cast<const T*>(part)[lane]; }
};
using EightInts = Eight<std::int32_t>;  // also the result of a comparison: 0 or -1
using EightFloats = Eight<float>;

// out.part = f(a.part, ...) for each part.
template <typename T, typename F, typename... A>
inline Eight<T> eight(F f, const A&... a) {
    Eight<T> out;
    for (int n = 0; n < kEightParts; ++n) out.part[n] = f(a.part[n]...);
    return out;
}

template <typename T>
inline Eight<T> eight_times(T value) {
    return eight<T>([value](auto zero) { return zero + value; }, Eight<T>{});
}

template <typename T>
inline Eight<T> operator+(const Eight<T>& a, const Eight<T>& b) {
    return eight<T>([](auto x, auto y) { return x + y; }, a, b);
}
template <typename T>
inline Eight<T> operator*(const Eight<T>& a, const Eight<T>& b) {
    return eight<T>([](auto x, auto y) { return x * y; }, a, b);
}
inline EightInts operator&(const EightInts& a, const EightInts& b) {
    return eight<std::int32_t>([](auto x, auto y) { return x & y; }, a, b);
}
inline EightInts operator~(const EightInts& a) {
    return eight<std::int32_t>([](auto x) { return ~x; }, a);
}
inline EightInts operator<(const EightInts& a, const EightInts& b) {
    return eight<std::int32_t>([](auto x, auto y) { return x < y; }, a, b);
}
inline EightInts operator>=(const EightInts& a, const EightInts& b) {
    return eight<std::int32_t>([](auto x, auto y) { return x >= y; }, a, b);
}
inline EightInts lower(const EightInts& a, const EightInts& b) {
    return eight<std::int32_t>([](auto x, auto y) { return x < y ? x : y; }, a, b);
}
inline EightInts choose(const EightInts& mask, const EightInts& a, const EightInts& b) {
    return eight<std::int32_t>([](auto m, auto x, auto y) { return m ? x : y; }, mask, a, b);
}
inline EightFloats floats(const EightInts& a) {
    return eight<float>([](auto x) { return __builtin_convertvector(x, EightFloats::Part); }, a);
}
// Towards 0.
inline EightInts whole(const EightFloats& a) {
    return eight<std::int32_t>([](auto x) { return __builtin_convertvector(x, EightInts::Part); }, a);
}

// True if any lane of a comparison is true.
inline bool any(const EightInts& mask) {
#if defined(__AVX2__)
    return __builtin_ia32_movmskps256((EightFloats::Part)mask.part[0]) != 0;
#else
    typedef std::int64_t Pair __attribute__((vector_size(16)));
    const Pair both = (Pair)(mask.part[0] | mask.part[1]);
    return (both[0] | both[1]) != 0;
#endif
}

// Lane n of the result is lane n + kBy of `a`, cyclic; kBy from 0 to 7.
template <int kBy, typename T>
inline Eight<T> rolled(const Eight<T>& a) {
    constexpr int first = kBy / kEightSize;
    EightInts::Part index{};
    for (int n = 0; n < kEightSize; ++n) index[n] = n + kBy % kEightSize;
    Eight<T> out;
    for (int n = 0; n < kEightParts; ++n)
        out.part[n] = __builtin_shuffle(a.part[(n + first) % kEightParts], a.part[(n + first + 1) % kEightParts], index);
    return out;
}

}  // namespace eldorado
