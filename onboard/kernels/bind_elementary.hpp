// Binding of the elementary functions: of one number, and of each number of a row.
#pragma once

#include "bind.hpp"
#include "elementary.hpp"

namespace eldorado {

template <double (*Function)(double)>
static void each_into(Array<const double, 1> from, Array<double, 1> to) {
    nb::gil_scoped_release unlocked;
    for (std::size_t k = 0; k < from.shape(0); ++k) to.data()[k] = Function(from.data()[k]);
}

template <double (*Function)(double)>
static void bind_one(nb::module_& m, const char* name, const char* into) {
    m.def(name, Function, "x"_a);
    m.def(into, &each_into<Function>, "numbers"_a, "to"_a);
}

static void atan2_into(Array<const double, 1> y, Array<const double, 1> x, Array<double, 1> to) {
    nb::gil_scoped_release unlocked;
    for (std::size_t k = 0; k < y.shape(0); ++k) to.data()[k] = elementary::atan2(y.data()[k], x.data()[k]);
}

inline void bind_elementary(nb::module_& m) {
    bind_one<elementary::sin>(m, "sin", "sin_into");
    bind_one<elementary::cos>(m, "cos", "cos_into");
    bind_one<elementary::tan>(m, "tan", "tan_into");
    bind_one<elementary::asin>(m, "asin", "asin_into");
    bind_one<elementary::acos>(m, "acos", "acos_into");
    bind_one<elementary::exp>(m, "exp", "exp_into");
    bind_one<elementary::log>(m, "log", "log_into");
    m.def("atan2", &elementary::atan2, "y"_a, "x"_a);
    m.def("atan2_into", &atan2_into, "y"_a, "x"_a, "to"_a);
    m.def("hypot", &elementary::hypot, "x"_a, "y"_a);
}

}  // namespace eldorado
