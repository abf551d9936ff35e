// Layers and edge costs of a height map: roughness and gradient of each node's 3 x 3 window, then the cost of the edges
// between nodes (Eq. 21 to 25, corrected). Single precision, because every number is a difference to the node's own
// height. No Python types, no exceptions, no heap. Loops run along a row with the same operations in every lane, so
// that the compiler vectorises them.
//
//        j + 1   NW  N  NE      k = 0 E, 1 NE, 2 N, 3 NW: the axes. Direction k + 4 is axis k backwards; as the law takes
//          j     W   .  E       magnitudes of roll and pitch, it costs the same to the last bit and is not stored twice:
//        j - 1   SW  S  SE      the edge of a node to the W is stored as the edge of its W neighbour to the E.
//
// A row's layers are stored in the memory of its edges, kAxes floats a node, until the edges replace them:
//
//        roughness of all its nodes | slope_x | slope_y | -      ->      E NE N NW of node 0 | E NE N NW of node 1 | ...
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace eldorado {

constexpr int kAxes = 4;
constexpr int kAxisRow[kAxes] = {0, 1, 1, 1}, kAxisColumn[kAxes] = {1, 1, 0, -1};
constexpr float kHighest_m = 1e7f;  // a height farther from zero is missing; its squares still fit single precision

// Progress of the work and stop flag; another thread may access both at any time.
struct Watch {
    std::int64_t* done;
    const std::uint8_t* cancel;

    void add(std::int64_t nodes) const { __atomic_fetch_add(done, nodes, __ATOMIC_RELAXED); }
    bool cancelled() const { return __atomic_load_n(cancel, __ATOMIC_RELAXED) != 0; }
};

struct GlobalMap {
    std::int64_t rows, columns;
    float cell_m;
    const float* heights_m;  // (rows, columns); a height not within kHighest_m of zero is missing
};

// Layers of one row, NaN where the node's own height is missing.
struct RowLayers {
    float *roughness_m, *slope_x, *slope_y;
};

inline RowLayers row_layers(float* edges_m, std::int64_t columns, std::int64_t j) {
    float* const row = edges_m + kAxes * columns * j;
    return {row, row + columns, row + 2 * columns};
}

// Eq. 25 divided by W_L / l_grid.
struct GlobalPrices {
    float roughness_per_m, roll_per_rad, pitch_per_rad;  // cost of a metre above 1
    float limit_rad;                                     // steeper about either axis is impassable
};

// atan(x), x >= 0: two steps of range reduction and a polynomial, to 2e-7 (Cephes). The same bits on every machine.
inline float arc_tangent(float x) {
    const bool steep = x > 2.414213562f, middle = x > 0.414213562f;
    const float over = steep ? -1.0f : (middle ? x - 1.0f : x), under = steep ? x : (middle ? x + 1.0f : 1.0f);
    const float t = over / under, s = t * t;
    const float tail = (((8.05374449538e-2f * s - 1.38776856032e-1f) * s + 1.99777106478e-1f) * s - 3.33329491539e-1f) * s;
    return (steep ? 1.570796327f : (middle ? 0.785398163f : 0.0f)) + (tail * t + t);
}

// A height, NaN where it is missing.
inline float height_of(float z) { return std::fabs(z) <= kHighest_m ? z : std::numeric_limits<float>::quiet_NaN(); }

// Row j of heights, -1 to `rows`, with one more node on either side: beyond the border the ground continues linearly.
inline void extended_row(const GlobalMap& map, std::int64_t j, double* __restrict row) {
    const std::int64_t last = map.rows - 1, columns = map.columns;
    const std::int64_t near = std::clamp<std::int64_t>(j, 0, last), inward = std::clamp<std::int64_t>(2 * near - j, 0, last);
    const float *__restrict z = map.heights_m + near * columns, *__restrict within = map.heights_m + inward * columns;
    if (j == near)
        for (std::int64_t i = 0; i < columns; ++i) row[i + 1] = height_of(z[i]);
    else
        for (std::int64_t i = 0; i < columns; ++i) row[i + 1] = 2.0 * height_of(z[i]) - height_of(within[i]);
    row[0] = 2.0 * row[1] - row[std::min<std::int64_t>(2, columns)];
    row[columns + 1] = 2.0 * row[columns] - row[std::max<std::int64_t>(columns - 1, 1)];
}

// Eq. 21, 23, 24 for one row. A missing neighbour is the reflection of the opposite one; if both are missing, the node
// itself. `roughest` stores the largest roughness of each column. kRaw: Eq. 21 as printed, slope included.
template <bool kRaw>
void layers_of_row(const double* __restrict south, const double* __restrict own, const double* __restrict north,
                   std::int64_t columns, float cell_m, float* __restrict roughness_m, float* __restrict slope_x,
                   float* __restrict slope_y, float* __restrict roughest) {
    const float per_slope = 1.0f / (6.0f * cell_m);
    const auto mirrored = [](float a, float b) { return a == a ? a : (b == b ? -b : 0.0f); };
    for (std::int64_t i = 0; i < columns; ++i) {
        const double z = own[i + 1];
        const auto above = [z](double height) { return static_cast<float>(height - z); };
        const float e0 = above(own[i + 2]), w0 = above(own[i]), n0 = above(north[i + 1]), s0 = above(south[i + 1]);
        const float ne0 = above(north[i + 2]), sw0 = above(south[i]), nw0 = above(north[i]), se0 = above(south[i + 2]);
        const float e = mirrored(e0, w0), w = mirrored(w0, e0), n = mirrored(n0, s0), s = mirrored(s0, n0);
        const float ne = mirrored(ne0, sw0), sw = mirrored(sw0, ne0), nw = mirrored(nw0, se0), se = mirrored(se0, nw0);
        const float gx = ((e - w) + (ne - nw) + (se - sw)) * per_slope, gy = ((n - s) + (ne - se) + (nw - sw)) * per_slope;
        const float mean = ((e + w) + (n + s) + (ne + sw) + (nw + se)) * (1.0f / 9.0f);  // the own difference is 0
        const float x = kRaw ? 0.0f : gx * cell_m, y = kRaw ? 0.0f : gy * cell_m;
        const auto square = [mean](float height, float plane) {
            const float off = height - mean - plane;
            return off * off;
        };
        const float sum = ((square(e, x) + square(w, -x)) + (square(n, y) + square(s, -y))) +
                          ((square(ne, x + y) + square(sw, -x - y)) + (square(nw, y - x) + square(se, x - y))) + mean * mean;
        const float rough = std::sqrt(sum * (1.0f / 9.0f));
        const float nothing = above(z);  // 0, NaN where the node has no height
        roughness_m[i] = rough + nothing;
        slope_x[i] = gx + nothing;
        slope_y[i] = gy + nothing;
        roughest[i] = std::max(roughest[i], roughness_m[i]);  // keeps the first if the second is NaN
    }
}

// Writes the layers of all rows to the memory of the edges; `rows` has 3 (columns + 2), `roughest` has columns
// elements. Returns the largest roughness, 0 without data, or -1 if it was cancelled.
inline float global_layers(const GlobalMap& map, bool raw, float* edges_m, double* rows, float* roughest, const Watch& watch) {
    double *south = rows, *own = south + map.columns + 2, *north = own + map.columns + 2;
    std::fill(roughest, roughest + map.columns, 0.0f);
    extended_row(map, -1, south);
    extended_row(map, 0, own);
    for (std::int64_t j = 0; j < map.rows; ++j) {
        if (watch.cancelled()) return -1.0f;
        extended_row(map, j + 1, north);
        const RowLayers out = row_layers(edges_m, map.columns, j);
        (raw ? layers_of_row<true> : layers_of_row<false>)(south, own, north, map.columns, map.cell_m, out.roughness_m,
                                                           out.slope_x, out.slope_y, roughest);
        double* const free = south;
        south = own, own = north, north = free;
        watch.add(map.columns);
    }
    return *std::max_element(roughest, roughest + map.columns);
}

// Cost of a metre along each axis at the nodes of one row, above 1: `price` is kAxes rows of `wide`, with one
// impassable node on either side. The roll of one axis is the pitch of the perpendicular axis.
inline void prices_of_row(const float* __restrict roughness_m, const float* __restrict slope_x,
                          const float* __restrict slope_y, std::int64_t columns, GlobalPrices p,
                          float* __restrict price) {
    constexpr float never = std::numeric_limits<float>::infinity(), half_root = 0.707106781f;
    const std::int64_t wide = columns + 2;
    for (int k = 0; k < kAxes; ++k) price[k * wide] = price[k * wide + columns + 1] = never;
    float *__restrict east = price + 1, *__restrict north_east = east + wide;
    float *__restrict north = north_east + wide, *__restrict north_west = north + wide;
    for (std::int64_t i = 0; i < columns; ++i) {
        const float x = slope_x[i], y = slope_y[i], rough = p.roughness_per_m * roughness_m[i];
        const float a = arc_tangent(std::fabs(x)), b = arc_tangent(std::fabs(x + y) * half_root);
        const float c = arc_tangent(std::fabs(y)), d = arc_tangent(std::fabs(y - x) * half_root);
        const float straight = rough + (std::max(a, c) <= p.limit_rad ? 0.0f : never);
        const float diagonal = rough + (std::max(b, d) <= p.limit_rad ? 0.0f : never);
        east[i] = straight + p.pitch_per_rad * a + p.roll_per_rad * c;
        north[i] = straight + p.pitch_per_rad * c + p.roll_per_rad * a;
        north_east[i] = diagonal + p.pitch_per_rad * b + p.roll_per_rad * d;
        north_west[i] = diagonal + p.pitch_per_rad * d + p.roll_per_rad * b;
    }
}

// One row's edges (columns, kAxes): length times 1 + the mean cost of both ends, +inf where impassable.
inline void edges_of_row(const float* __restrict own, const float* __restrict north, const float* __restrict price,
                         const float* __restrict price_north, std::int64_t columns, float cell_m, float* __restrict edges_m) {
    constexpr float never = std::numeric_limits<float>::infinity();
    const std::int64_t wide = columns + 2;
    const float straight = cell_m * cell_m, diagonal = 2.0f * straight;
    const auto cost = [never](float square, float rise, float here, float there) {
        const float all = std::sqrt(square + rise * rise) * (1.0f + 0.5f * (here + there));
        return all < never ? all : never;
    };
    for (std::int64_t i = 0; i < columns; ++i) {
        const float z = own[i + 1];
        const float *h = price + i + 1, *n = price_north + i + 1;
        edges_m[kAxes * i] = cost(straight, own[i + 2] - z, h[0], h[1]);
        edges_m[kAxes * i + 1] = cost(diagonal, north[i + 2] - z, h[wide], n[wide + 1]);
        edges_m[kAxes * i + 2] = cost(straight, north[i + 1] - z, h[2 * wide], n[2 * wide]);
        edges_m[kAxes * i + 3] = cost(diagonal, north[i] - z, h[3 * wide], n[3 * wide - 1]);
    }
}

// Row j for `edges_of_row`: heights with a missing node on either side, and costs; row `rows` is missing.
inline void enter_row(const GlobalMap& map, float* edges_m, const GlobalPrices& prices, std::int64_t j,
                      float* __restrict heights_m, float* __restrict price) {
    std::fill(heights_m, heights_m + map.columns + 2, std::numeric_limits<float>::quiet_NaN());
    if (j == map.rows) return;
    const std::int64_t at = j * map.columns;
    for (std::int64_t i = 0; i < map.columns; ++i) heights_m[i + 1] = height_of(map.heights_m[at + i]);
    const RowLayers layers = row_layers(edges_m, map.columns, j);
    prices_of_row(layers.roughness_m, layers.slope_x, layers.slope_y, map.columns, prices, price);
}

// Converts the layers in `edges_m` to edges (rows, columns, kAxes); `rows` has 10 (columns + 2) elements. Returns false
// if it was cancelled.
inline bool global_edges(const GlobalMap& map, const GlobalPrices& prices, float* edges_m, float* rows, const Watch& watch) {
    const std::int64_t wide = map.columns + 2;
    float *own = rows, *north = rows + wide, *price = rows + 2 * wide, *price_north = price + kAxes * wide;
    enter_row(map, edges_m, prices, 0, own, price);
    for (std::int64_t j = 0; j < map.rows; ++j) {
        if (watch.cancelled()) return false;
        enter_row(map, edges_m, prices, j + 1, north, price_north);
        edges_of_row(own, north, price, price_north, map.columns, map.cell_m, edges_m + kAxes * j * map.columns);
        std::swap(own, north);
        std::swap(price, price_north);
        watch.add(map.columns);
    }
    return true;
}

}  // namespace eldorado
