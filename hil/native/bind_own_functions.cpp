// Our elementary functions for foreign libraries (own_functions.hpp), for Python. Checks are in hil/own_functions.py.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

#include "own_functions.hpp"

namespace nb = nanobind;

static std::vector<std::string> give(const std::string& path) {
    std::string why;
    std::vector<std::string> given = own::give(path.c_str(), why);
    if (!why.empty()) throw std::runtime_error(path + ": " + why);
    return given;
}

NB_MODULE(_own_functions, m) {
    m.def("give", &give);
    m.def("pow", &own::pow);
    m.def("log1p", &own::log1p);
    m.def("expm1", &own::expm1);
}
