// What the two distance transforms share: the problem, how it is watched, and the length of a diagonal step.
#pragma once

#include <cstdint>

namespace eldorado {

// Fields get a rim of one cell around rows x columns that is not free: padded sizes, flat indices of it.
struct GridProblem {
    std::int64_t rows, columns;  // without the rim
    const std::uint8_t* free;    // (rows, columns) not 0: free
    const std::uint8_t* goals;   // (rows, columns) not 0: a goal; counts where it is free
    const float* closeness;      // (rows, columns) >= 0, or null
    double cell_m;
};

struct GridWatch {
    std::int64_t* progress;      // cells done so far; read by others meanwhile
    const std::uint8_t* cancel;  // the search stops soon after it is not 0
};

constexpr double kGridDiagonal = 1.4142135623730951;

}  // namespace eldorado
