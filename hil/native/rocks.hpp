// Rays against soil with rocks on it, exact to rounding: the soil is a raster, a rock a closed body of triangles.
//
// A ray walks over the raster's squares; each square lists the rocks that may cover it, and a rock is tested once per
// ray (`asked`: one mark per rock, owned by the caller). Rocks that extend over the raster's rim are tested for every
// ray.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "heightfield.hpp"

namespace rocks {

using heightfield::kMiss;
using Vector = std::array<double, 3>;

struct Rocks {
    const double* triangles;      // (t, 3, 3): corner a, edges b - a and c - a
    const std::int32_t* first;    // (n + 1) first triangle of each rock
    const double* boxes;          // (n, 2, 3) lower and upper corners
    const std::int32_t* of;       // rocks, square after square
    const std::int32_t* of_from;  // (squares + 1) first entry of each square in `of`
    const std::int32_t* rim;      // rocks that extend over the rim
    std::int64_t rims;
    const float* reach;           // (squares) highest point of soil and rocks over each
    const float* tile_reach;      // the same for each tile of the raster
    double low_m, high_m;         // lowest and highest point of soil and rocks
};

inline Vector cross(const Vector& a, const double* b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double dot(const Vector& a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// True if the ray passes through a box before `best`.
inline bool meets(const double* box, const Vector& from, const Vector& way, double best) {
    double t = 0.0;
    for (int k = 0; k < 3; ++k) {
        if (way[k] == 0.0) {
            if (from[k] < box[k] || from[k] > box[k + 3]) return false;
            continue;
        }
        const double a = (box[k] - from[k]) / way[k], b = (box[k + 3] - from[k]) / way[k];
        t = std::max(t, std::min(a, b));
        best = std::min(best, std::max(a, b));
    }
    return t <= best;
}

// Range to one triangle, kMiss off it (Moeller and Trumbore 1997). Its rim is included: no ray slips between two.
inline double triangle(const double* a, const Vector& from, const Vector& way) {
    constexpr double kRim = 1e-12;
    const double *ab = a + 3, *ac = a + 6;
    const Vector p = cross(way, ac);
    const double det = dot(p, ab);
    if (det == 0.0) return kMiss;
    const Vector away{from[0] - a[0], from[1] - a[1], from[2] - a[2]};
    const double u = dot(away, p.data()) / det;
    if (u < -kRim || u > 1.0 + kRim) return kMiss;
    const Vector q = cross(away, ab);
    const double v = dot(way, q.data()) / det;
    if (v < -kRim || u + v > 1.0 + kRim) return kMiss;
    const double t = dot(q, ac) / det;
    return t > 0.0 ? t : kMiss;
}

inline double rock(const Rocks& all, std::int32_t n, const Vector& from, const Vector& way, double best) {
    if (!meets(all.boxes + 6 * n, from, way, best)) return best;
    for (std::int32_t k = all.first[n]; k < all.first[n + 1]; ++k)
        best = std::min(best, triangle(all.triangles + 9 * k, from, way));
    return best;
}

// Range of the first hit on soil or rock, kMiss if nothing is met within `range_m`. mark: a different one per ray.
inline double cast(const heightfield::Raster& soil, const Rocks& all, const Vector& from, const Vector& way,
                   double range_m, std::int32_t mark, std::int32_t* asked) {
    double best = kMiss, t = 0.0, end = range_m;
    for (std::int64_t k = 0; k < all.rims; ++k) best = rock(all, all.rim[k], from, way, best);
    if (way[2] != 0.0) {
        const double a = (all.low_m - from[2]) / way[2], b = (all.high_m - from[2]) / way[2];
        t = std::max(t, std::min(a, b));
        end = std::min(end, std::max(a, b));
    } else if (from[2] > all.high_m) {
        return kMiss;
    }
    const double cell_m = soil.cell_m;
    const heightfield::Ray ray{(from[0] - soil.x0_m) / cell_m, (from[1] - soil.y0_m) / cell_m, from[2],
                               way[0] / cell_m, way[1] / cell_m, way[2]};
    const auto lowest = [&](double enters, double leaves) { return from[2] + way[2] * (way[2] < 0.0 ? leaves : enters); };
    const auto clear = [&](std::int64_t tile, double enters, double leaves) {
        return lowest(enters, leaves) > all.tile_reach[tile];
    };
    heightfield::walk(soil, ray, t, end, clear, [&](std::int64_t j, std::int64_t i, double enters, double leaves) {
        const std::int64_t square = j * (soil.columns - 1) + i;
        if (lowest(enters, leaves) > all.reach[square]) return best <= leaves;
        for (std::int32_t k = all.of_from[square]; k < all.of_from[square + 1]; ++k) {
            const std::int32_t n = all.of[k];
            if (asked[n] == mark) continue;
            asked[n] = mark;
            best = rock(all, n, from, way, best);
        }
        best = std::min(best, heightfield::detail::square(soil, ray, j, i, enters, leaves));
        return best <= leaves;
    });
    return best <= range_m ? best : kMiss;
}

}  // namespace rocks
