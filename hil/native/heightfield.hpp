// Rays against a triangulated raster of heights, exact to rounding. No Python types, no exceptions, no heap.
//
// Heights are on the corners of squares; each square is two triangles, cut from (i + 1, j) to (i, j + 1):
//
//     j + 1  +---+      A ray walks from square to square (Amanatides and Woo 1987). Within a square its height above
//            |\ 2|      either triangle is linear in t: it is evaluated where the ray enters, crosses the cut and
//     j      | 1\|      leaves. The first change from above to below is the hit.
//            +---+
//            i  i + 1   Squares whose highest corner is below the ray's piece are skipped, and so is a whole tile of
//                       squares at once. Skipping does not change the computed borders by a single bit.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace heightfield {

constexpr int kTileBits = 4;  // 16 x 16 squares are a tile
constexpr std::int64_t kTile = 1 << kTileBits;

struct Raster {
    const float* z;           // (rows, columns)
    const float* top;         // (rows - 1, columns - 1) highest corner of each square
    const float* tile_top;    // of each tile: of kTile x kTile squares, less at the last row and column
    std::int64_t rows, columns;
    double x0_m, y0_m, cell_m;

    std::int64_t tile_columns() const { return (columns - 2 + kTile) >> kTileBits; }
};

struct Ray {
    double u, v, z;     // start, in cells and metres
    double du, dv, dz;  // per metre of way
};

constexpr double kMiss = std::numeric_limits<double>::infinity();

namespace detail {

// Height of the ray above the lower (u + v <= 1) or the upper triangle of square (j, i), at t.
inline double over(const Raster& r, const Ray& ray, std::int64_t j, std::int64_t i, double t, bool lower) {
    const float* at = r.z + j * r.columns + i;
    const double z10 = at[1], z01 = at[r.columns];
    const double u = ray.u + t * ray.du - static_cast<double>(i), v = ray.v + t * ray.dv - static_cast<double>(j);
    const double ground = lower ? at[0] + u * (z10 - at[0]) + v * (z01 - at[0])
                                : at[r.columns + 1] + (1 - u) * (z01 - at[r.columns + 1]) + (1 - v) * (z10 - at[r.columns + 1]);
    return ray.z + t * ray.dz - ground;
}

// Range of the hit within [t0, t1] on one triangle, kMiss if the ray stays above it.
inline double piece(const Raster& r, const Ray& ray, std::int64_t j, std::int64_t i, double t0, double t1) {
    const double middle = 0.5 * (t0 + t1);
    const double sum = ray.u + middle * ray.du - static_cast<double>(i) + ray.v + middle * ray.dv - static_cast<double>(j);
    const bool lower = sum <= 1.0;
    const double a = over(r, ray, j, i, t0, lower), b = over(r, ray, j, i, t1, lower);
    if (b > 0.0) return kMiss;
    return a > 0.0 ? t0 + (t1 - t0) * (a / (a - b)) : t0;
}

inline double square(const Raster& r, const Ray& ray, std::int64_t j, std::int64_t i, double t0, double t1) {
    const double lowest = ray.z + ray.dz * (ray.dz < 0.0 ? t1 : t0);
    if (lowest > r.top[j * (r.columns - 1) + i]) return kMiss;
    const double along = ray.du + ray.dv;
    const double cut = along != 0.0 ? (static_cast<double>(i + j + 1) - ray.u - ray.v) / along : kMiss;
    if (!(cut > t0 && cut < t1)) return piece(r, ray, j, i, t0, t1);
    const double first = piece(r, ray, j, i, t0, cut);
    return first < kMiss ? first : piece(r, ray, j, i, cut, t1);
}

// Number of squares of the tile beyond `index` in the direction of travel.
inline std::int64_t left(std::int64_t index, std::int64_t way) {
    const std::int64_t within = index & (kTile - 1);
    return way > 0 ? kTile - 1 - within : within;
}

// Add step by step, as a walk over squares does: `next + count * step` rounds differently.
inline double added(double next, double step, std::int64_t count) {
    for (; count > 0; --count) next += step;
    return next;
}

}  // namespace detail

// Calls visit(j, i, from, to) for the squares that a ray crosses between `t` and `end`, in order, until it returns
// true. Skips the squares of a tile if clear(tile, from, to) is true: nothing in the tile reaches the ray's piece.
template <typename Clear, typename Visit>
inline void walk(const Raster& r, const Ray& ray, double t, double end, Clear clear, Visit visit) {
    const double width = static_cast<double>(r.columns - 1), height = static_cast<double>(r.rows - 1);
    for (const auto& [at, way, size] : {std::array{ray.u, ray.du, width}, std::array{ray.v, ray.dv, height}}) {
        if (way == 0.0) {
            if (at < 0.0 || at >= size) return;
            continue;
        }
        const double a = -at / way, b = (size - at) / way;
        t = std::max(t, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    if (!(t < end)) return;
    auto i = std::clamp(static_cast<std::int64_t>(std::floor(ray.u + t * ray.du)), std::int64_t{0}, r.columns - 2);
    auto j = std::clamp(static_cast<std::int64_t>(std::floor(ray.v + t * ray.dv)), std::int64_t{0}, r.rows - 2);
    const double step_u = ray.du != 0.0 ? 1.0 / std::abs(ray.du) : kMiss, step_v = ray.dv != 0.0 ? 1.0 / std::abs(ray.dv) : kMiss;
    const std::int64_t way_i = ray.du > 0.0 ? 1 : -1, way_j = ray.dv > 0.0 ? 1 : -1;
    double next_u = ray.du != 0.0 ? (static_cast<double>(i + (way_i > 0)) - ray.u) / ray.du : kMiss;
    double next_v = ray.dv != 0.0 ? (static_cast<double>(j + (way_j > 0)) - ray.v) / ray.dv : kMiss;
    const std::int64_t tiles = r.tile_columns();
    std::int64_t tile = -1;
    while (t < end && i >= 0 && j >= 0 && i < r.columns - 1 && j < r.rows - 1) {
        if (const std::int64_t here = (j >> kTileBits) * tiles + (i >> kTileBits); here != tile) {
            tile = here;
            const std::int64_t left_i = detail::left(i, way_i), left_j = detail::left(j, way_j);
            const double out_u = detail::added(next_u, step_u, left_i), out_v = detail::added(next_v, step_v, left_j);
            const double out = std::max(t, std::min({out_u, out_v, end}));
            if (clear(tile, t, out)) {
                if (out_u <= out_v) {
                    i += way_i * (left_i + 1);
                    next_u = out_u + step_u;
                    for (; next_v < out_u; next_v += step_v) j += way_j;
                } else {
                    j += way_j * (left_j + 1);
                    next_v = out_v + step_v;
                    for (; next_u <= out_v; next_u += step_u) i += way_i;
                }
                t = out;
                continue;
            }
        }
        const double leave = std::max(t, std::min({next_u, next_v, end}));
        if (visit(j, i, t, leave)) return;
        if (next_u <= next_v) {
            i += way_i;
            next_u += step_u;
        } else {
            j += way_j;
            next_v += step_v;
        }
        t = leave;
    }
}

// Range of the first hit, kMiss if nothing is met within `range_m` or on the raster.
inline double cast(const Raster& r, const Ray& ray, double range_m) {
    double hit = kMiss;
    const auto clear = [&](std::int64_t tile, double from, double to) {
        return ray.z + ray.dz * (ray.dz < 0.0 ? to : from) > r.tile_top[tile];
    };
    walk(r, ray, 0.0, range_m, clear, [&](std::int64_t j, std::int64_t i, double from, double to) {
        hit = detail::square(r, ray, j, i, from, to);
        return hit < kMiss;
    });
    return hit;
}

}  // namespace heightfield
