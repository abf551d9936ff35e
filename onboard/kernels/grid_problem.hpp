// Shared parts of the two distance transforms: the problem, its progress, and the length of a diagonal step.
#pragma once

#include <cstdint>

namespace eldorado {

// Fields have a rim of one cell that is not free around rows x columns: padded sizes, flat indices of it.
struct GridProblem {
    std::int64_t rows, columns;  // without the rim
    const std::uint8_t* free;    // (rows, columns) not 0: free
    const std::uint8_t* goals;   // (rows, columns) not 0: a goal; counts where it is free
    const float* closeness;      // (rows, columns) >= 0, or null
    double cell_m;
};

struct GridWatch {
    std::int64_t* progress;      // cells done so far; other threads read it
    const std::uint8_t* cancel;  // the search stops soon after it is not 0
};

constexpr double kGridDiagonal = 1.4142135623730951;

}  // namespace eldorado
