// Beams of one stop to statistics of map cells. No Python types, no exceptions, no heap: the caller owns every array.
//
// Grid units: u = (x - x0) / cell + 1/2, so cell i covers [i, i + 1). A beam is traced cell by cell (Amanatides and Woo
// 1987); the number of border crossings is the integer distance of its end cells, so rounding never leads it off the
// grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace eldorado {

struct RasterGrid {
    double x0_m, y0_m, cell_m;
    std::int64_t rows, columns;
};

// All (rows, columns). On entry: 0 in n and the sums, NaN in the four heights, +inf in z_ray and view_m.
struct RasterCells {
    std::int32_t* n;
    double* sum_z;
    double* sum_z2;
    float* z_hi;   // highest hit
    float* z_lo;   // lowest hit
    float* z_hi2;  // second highest hit; the hit itself if there is only one
    float* z_lo2;  // second lowest hit
    float* sum_sigma;
    float* z_ray;
    float* view_m;
};

struct Beams {
    const double* origin_m;     // (3,)
    const float* ends_m;        // (count, 3)
    const std::uint8_t* hit;    // (count,) 0 or 1
    std::int64_t count;
    double sigma_range_m;
};

namespace detail {

// Narrows [t0, t1] to the part where a + t * d lies in [0, size]; false if there is none.
inline bool clip(double a, double d, double size, double& t0, double& t1) {
    if (d == 0.0) return a >= 0.0 && a < size;
    double enter = (0.0 - a) / d, leave = (size - a) / d;
    if (enter > leave) std::swap(enter, leave);
    t0 = std::max(t0, enter);
    t1 = std::min(t1, leave);
    return t0 < t1;
}

inline std::int64_t cell_of(double u, std::int64_t size) {
    return std::clamp(static_cast<std::int64_t>(std::floor(u)), std::int64_t{0}, size - 1);
}

// One axis of the trace: parameter of the next border, its step, cells left to cross.
struct Axis {
    double next, step;
    std::int64_t left, stride;
};

inline Axis axis(double a, double d, std::int64_t from, std::int64_t to, std::int64_t stride) {
    constexpr double never = std::numeric_limits<double>::infinity();
    if (from == to) return {never, never, 0, 0};
    const std::int64_t way = to > from ? 1 : -1;
    const double border = static_cast<double>(way > 0 ? from + 1 : from);
    return {(border - a) / d, 1.0 / std::abs(d), way * (to - from), way * stride};
}

inline void lower(float& z_ray, double z) {
    const float height = static_cast<float>(z);
    if (height < z_ray) z_ray = height;
}

// Lowers z_ray along the crossed cells: at the exit of a cell if the beam falls, at the entry if it rises.
// `keep_last`: the last cell was crossed as well, up to t1.
template <bool kFalls>
inline void lower_rays(float* z_ray, std::int64_t at, const Axis x, const Axis y, double z, double dz, double t0, double t1,
                       bool keep_last) {
    constexpr double never = std::numeric_limits<double>::infinity();
    double entry = t0, next_x = x.next, next_y = y.next;
    std::int64_t left_x = x.left, left_y = y.left;
    while (left_x + left_y > 0) {
        const bool along_x = next_x <= next_y;
        const double exit = along_x ? next_x : next_y;
        lower(z_ray[at], z + dz * (kFalls ? exit : entry));
        at += along_x ? x.stride : y.stride;
        left_x -= along_x;
        left_y -= !along_x;
        next_x = left_x == 0 ? never : next_x + (along_x ? x.step : 0.0);
        next_y = left_y == 0 ? never : next_y + (along_x ? 0.0 : y.step);
        entry = exit;
    }
    if (keep_last) lower(z_ray[at], z + dz * (kFalls ? t1 : entry));
}

inline void count_hit(const RasterCells& c, std::int64_t at, double z, double sigma, double distance) {
    const float height = static_cast<float>(z), view = static_cast<float>(distance);
    c.sum_z[at] += z;
    c.sum_z2[at] += z * z;
    c.sum_sigma[at] += static_cast<float>(sigma);
    const std::int32_t before = c.n[at]++;
    if (before == 0) {
        c.z_hi[at] = c.z_lo[at] = c.z_hi2[at] = c.z_lo2[at] = height;
        c.view_m[at] = view;
        return;
    }
    if (before == 1) {
        c.z_hi2[at] = std::min(c.z_hi[at], height);
        c.z_lo2[at] = std::max(c.z_lo[at], height);
    } else {
        c.z_hi2[at] = std::max(c.z_hi2[at], std::min(c.z_hi[at], height));
        c.z_lo2[at] = std::min(c.z_lo2[at], std::max(c.z_lo[at], height));
    }
    c.z_hi[at] = std::max(c.z_hi[at], height);
    c.z_lo[at] = std::min(c.z_lo[at], height);
    c.view_m[at] = std::min(c.view_m[at], view);
}

}  // namespace detail

// Adds every beam to `cells`. Beams whose end is not finite are left out; cells outside the grid are not written.
// sigma_z of a hit = sigma_range * |sin(elevation)|; view_m = least horizontal distance of a hit from the origin.
inline void rasterise(const RasterGrid& grid, const Beams& beams, const RasterCells& cells) {
    const double per_m = 1.0 / grid.cell_m, z = beams.origin_m[2];
    const double u0 = (beams.origin_m[0] - grid.x0_m) * per_m + 0.5, v0 = (beams.origin_m[1] - grid.y0_m) * per_m + 0.5;
    for (std::int64_t k = 0; k < beams.count; ++k) {
        const float* end = beams.ends_m + 3 * k;
        const double dx = end[0] - beams.origin_m[0], dy = end[1] - beams.origin_m[1], dz = end[2] - z;
        if (!std::isfinite(dx + dy + dz)) continue;
        const double du = dx * per_m, dv = dy * per_m;
        double t0 = 0.0, t1 = 1.0;
        if (!detail::clip(u0, du, static_cast<double>(grid.columns), t0, t1)) continue;
        if (!detail::clip(v0, dv, static_cast<double>(grid.rows), t0, t1)) continue;
        const std::int64_t i0 = detail::cell_of(u0 + t0 * du, grid.columns), j0 = detail::cell_of(v0 + t0 * dv, grid.rows);
        const std::int64_t i1 = detail::cell_of(u0 + t1 * du, grid.columns), j1 = detail::cell_of(v0 + t1 * dv, grid.rows);
        const double u_end = std::floor(u0 + du), v_end = std::floor(v0 + dv);
        const bool inside = u_end == static_cast<double>(i1) && v_end == static_cast<double>(j1);
        const bool counts = beams.hit[k] != 0 && inside;
        const detail::Axis x = detail::axis(u0, du, i0, i1, 1), y = detail::axis(v0, dv, j0, j1, grid.columns);
        const std::int64_t from = j0 * grid.columns + i0;
        if (dz < 0.0) detail::lower_rays<true>(cells.z_ray, from, x, y, z, dz, t0, t1, !counts);
        else detail::lower_rays<false>(cells.z_ray, from, x, y, z, dz, t0, t1, !counts);
        if (!counts) continue;
        const double flat = std::sqrt(dx * dx + dy * dy), length = std::sqrt(flat * flat + dz * dz);
        const double sigma = length > 0.0 ? beams.sigma_range_m * std::abs(dz) / length : 0.0;
        detail::count_hit(cells, j1 * grid.columns + i1, end[2], sigma, flat);
    }
}

}  // namespace eldorado
