// A line for each function of the kernels' arithmetic: its name and a hash (FNV-1a) of its results' bits.
// Compiled for two processors by the kernels' own flags; the same inputs are made by each.
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "../../onboard/kernels/eight.hpp"
#include "../../onboard/kernels/elementary.hpp"
#include "../../onboard/kernels/linear.hpp"

using namespace eldorado;

static constexpr int kInputs = 200000, kSolved = 20000, kSize = 6;
static std::uint64_t state;

static std::uint64_t drawn() {  // xorshift64*
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return state * 2685821657736338717u;
}

static double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(drawn() >> 11) * 0x1p-53);
}

static double of_any_bits() {
    const std::uint64_t bits = drawn();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

class Line {
public:
    Line() { state = 88172645463325252u; }  // each line from the same begin: one that differs moves no other

    template <typename T>
    void add(const T& value) {
        unsigned char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        for (const unsigned char byte : bytes) hash_ = (hash_ ^ byte) * 1099511628211u;
    }

    void add_number(double value) {  // every NaN is one: which one an operation makes is the processor's choice
        if (value != value) add(std::uint64_t{0x7ff8000000000000u});
        else add(value);
    }

    void print(const char* name, const char* inputs) const {
        std::printf("%s of %s: %016llx\n", name, inputs, static_cast<unsigned long long>(hash_));
    }

private:
    std::uint64_t hash_ = 14695981039346656037u;
};

template <typename F>
static void of_one(const char* name, double low, double high, F function) {
    Line usual;
    for (int k = 0; k < kInputs; ++k) usual.add_number(function(between(low, high)));
    usual.print(name, "usual numbers");
    Line any;
    for (int k = 0; k < kInputs; ++k) any.add_number(function(of_any_bits()));
    any.print(name, "any bits");
}

template <typename F>
static void of_two(const char* name, F function) {
    Line usual;
    for (int k = 0; k < kInputs; ++k) {
        const double a = between(-20.0, 20.0), b = between(-20.0, 20.0);
        usual.add_number(function(a, b));
    }
    usual.print(name, "usual numbers");
    Line any;
    for (int k = 0; k < kInputs; ++k) {
        const double a = of_any_bits(), b = of_any_bits();
        any.add_number(function(a, b));
    }
    any.print(name, "any bits");
}

static void of_matrices() {
    Line products, solutions;
    double a[kSize * kSize], b[kSize * kSize], made[kSize * kSize];
    for (int k = 0; k < kSolved; ++k) {
        for (int n = 0; n < kSize * kSize; ++n) {
            a[n] = between(-2.0, 2.0);
            b[n] = between(-2.0, 2.0);
        }
        product(a, b, made, kSize, kSize, kSize);
        for (const double value : made) products.add_number(value);
        solutions.add(solve(a, b, kSize, kSize));
        for (const double value : b) solutions.add_number(value);
    }
    products.print("product", "6 x 6 matrices");
    solutions.print("solve", "6 x 6 matrices");
}

static void of_lanes() {
    Line line;
    for (int k = 0; k < kInputs; ++k) {
        EightFloats a, b;
        for (int lane = 0; lane < 8; ++lane) {
            a[lane] = static_cast<float>(between(-1000.0, 1000.0));
            b[lane] = static_cast<float>(between(0.0, 3.0));
        }
        const EightInts cut = whole(a * (eight_times(1.0f) + b)), low = lower(cut, whole(a));
        for (int lane = 0; lane < 8; ++lane) line.add(choose(cut < low, cut, low)[lane]);
        line.add(any(low < cut));
    }
    line.print("products, sums, whole parts and choices", "eight lanes");
}

int main() {
    namespace e = eldorado::elementary;
    of_one("sin", -400.0, 400.0, e::sin);
    of_one("cos", -400.0, 400.0, e::cos);
    of_one("tan", -400.0, 400.0, e::tan);
    of_one("atan", -50.0, 50.0, e::atan);
    of_one("asin", -1.0, 1.0, e::asin);
    of_one("acos", -1.0, 1.0, e::acos);
    of_one("exp", -40.0, 40.0, e::exp);
    of_one("log", 0.0, 1e6, e::log);
    of_two("atan2", e::atan2);
    of_two("hypot", e::hypot);
    of_matrices();
    of_lanes();
}
