// Shared helpers of the bindings: arrays passed from Python. Checks are in the Python interface (raster.py, ...).
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;

// Contiguous rows, in this machine's memory.
template <typename T, int N>
using Array = nb::ndarray<T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;
