// Cost of a straight drive, if it is free. No Python types, no exceptions, no heap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace eldorado {

struct SightGround {
    std::int64_t orientations, rows, columns;
    const std::uint8_t* free;  // (orientations, rows, columns) 0 or 1
    const float* closeness;    // the same shape, >= 0, or null
    double x0_m, y0_m, cell_m;
};

// The stations a to b, both included, evenly at most spacing_m apart, the body's axis at `orientation` (0 ..)
// throughout.
struct SightLine {
    double ax_m, ay_m, bx_m, by_m, spacing_m;
    std::int64_t orientation;
};

// Metres from a to b, each piece times 1 + the mean closeness of its ends; +inf where the pose of a station (nearest cell)
// is not free or off the grid.
inline double sight_price(const SightGround& ground, const SightLine& line) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const double dx = line.bx_m - line.ax_m, dy = line.by_m - line.ay_m;
    const double pieces = std::max(1.0, std::ceil(std::sqrt(dx * dx + dy * dy) / line.spacing_m - 1e-9));
    const std::int64_t layer = line.orientation * ground.rows * ground.columns;
    double price = 0.0, x_before = line.ax_m, y_before = line.ay_m;
    double near_before = 0.0;
    for (double k = 0.0; k <= pieces; k += 1.0) {
        const bool last = k == pieces;
        const double x = last ? line.bx_m : k * (dx / pieces) + line.ax_m;
        const double y = last ? line.by_m : k * (dy / pieces) + line.ay_m;
        const double i = std::nearbyint((x - ground.x0_m) / ground.cell_m);
        const double j = std::nearbyint((y - ground.y0_m) / ground.cell_m);
        const bool inside = i >= 0.0 && i < static_cast<double>(ground.columns) && j >= 0.0 &&
                            j < static_cast<double>(ground.rows);
        if (!inside) return never;
        const std::int64_t at = layer + static_cast<std::int64_t>(j) * ground.columns + static_cast<std::int64_t>(i);
        if (ground.free[at] == 0) return never;
        const double near = ground.closeness ? ground.closeness[at] : 0.0;
        const double way = std::sqrt((x - x_before) * (x - x_before) + (y - y_before) * (y - y_before));
        price += way * (1.0 + 0.5 * (near + near_before));
        x_before = x;
        y_before = y;
        near_before = near;
    }
    return price;
}

}  // namespace eldorado
