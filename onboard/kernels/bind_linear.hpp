// Binding of products and equations of matrices; linear.py checks shapes.
#pragma once

#include <optional>

#include "bind.hpp"
#include "linear.hpp"

namespace eldorado {

// Numbers from which Python's lock is released. The small matrices of a tick keep it: their product is quicker.
constexpr std::size_t LARGE = 4096;

static void product_into(Array<const double, 2> a, Array<const double, 2> b, Array<double, 2> to) {
    const std::size_t n = a.shape(0), k = a.shape(1), m = b.shape(1);
    std::optional<nb::gil_scoped_release> unlocked;
    if (n * (k + m) > LARGE) unlocked.emplace();
    if (k == 3 && m == 3)
        turned(a.data(), b.data(), to.data(), n);
    else
        product(a.data(), b.data(), to.data(), n, k, m);
}

// Solves many systems: a (count, n, n) is overwritten, b (count, n, m) becomes x.
static bool solve_into(Array<double, 3> a, Array<double, 3> b) {
    const std::size_t n = a.shape(1), m = b.shape(2);
    std::optional<nb::gil_scoped_release> unlocked;
    if (a.size() > LARGE) unlocked.emplace();
    bool regular = true;
    for (std::size_t k = 0; k < a.shape(0); ++k)
        regular = solve(a.data() + k * n * n, b.data() + k * n * m, n, m) && regular;
    return regular;
}

inline void bind_linear(nb::module_& m) {
    m.def("product_into", &product_into, "a"_a, "b"_a, "to"_a);
    m.def("solve_into", &solve_into, "a"_a, "b"_a);
}

}  // namespace eldorado
