// Hits to five statistics of map cells, without ray casting: from points, or directly from ranges and tilt. No Python
// types, no exceptions, no heap: the caller owns every array.
//
// A cell is one record of 32 bytes, so a hit touches one cache line. The sums are added in the order of the hits, so a
// live grid has the same bits as one insertion of all hits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "rasterise.hpp"

namespace eldorado {

struct Cell {
    double sum_z, sum_z2;
    float z_hi, z_lo;  // NaN while n == 0
    std::int32_t n, unused;
};
static_assert(sizeof(Cell) == 32, "two to a cache line; onboard/kernel_calls/cells.py CELL");
constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();
constexpr Cell kNoHit{0.0, 0.0, kNoHeight, kNoHeight, 0, 0};

// One turn of the scanner, or a part of it.
struct Turn {
    const float* ranges_m;   // (count,) NaN: no hit
    const double* azimuths;  // (2, count) cosines, sines of the beams' angles in the scanner's plane
    const double* tilts;     // (2, count) cosines, sines of the tilt at each beam's own time, positive down
    std::int64_t count;
    double longest_m;  // farther returns are no hits
};

// Mounting of the scanner, hull of the rover and pose.
struct Mount {
    const double* scanner_m;   // (3,) in base axes, on the tilt axis
    const double* hull_m;      // (boxes, 2, 3) lowest and highest corner, base axes: hits inside are dropped
    std::int64_t boxes;
    const double* T_map_base;  // (4, 4)
};

namespace detail {

// Cell index of a hit, and its insertion, as two steps: the first runs on many hits at once, the second in order.
class Hits {
public:
    Hits(const RasterGrid& grid, Cell* cells)
        : x0_m_(grid.x0_m), y0_m_(grid.y0_m), per_m_(1.0 / grid.cell_m), columns_(static_cast<double>(grid.columns)),
          rows_(static_cast<double>(grid.rows)), stride_(static_cast<std::int32_t>(grid.columns)), cells_(cells) {}

    // The cell of a hit, -1 off the grid or if a number is not finite. The caller keeps rows * columns within int32.
    std::int32_t at(float x, float y, float z) const {
        const double u = (x - x0_m_) * per_m_ + 0.5, v = (y - y0_m_) * per_m_ + 0.5;
        const bool on = (u >= 0.0) & (u < columns_) & (v >= 0.0) & (v < rows_) & (std::abs(z) <= kLargest);
        return on ? static_cast<std::int32_t>(on ? v : 0.0) * stride_ + static_cast<std::int32_t>(on ? u : 0.0) : -1;
    }

    void fetch(std::int32_t at) const { __builtin_prefetch(cells_ + at, 1); }

    void add(std::int32_t at, float z) const {
        Cell& cell = cells_[at];
        const double height = z;
        cell.sum_z += height;
        cell.sum_z2 += height * height;
        cell.z_hi = cell.z_hi > z ? cell.z_hi : z;  // false for NaN, which is replaced
        cell.z_lo = cell.z_lo < z ? cell.z_lo : z;
        ++cell.n;
    }

private:
    static constexpr float kLargest = std::numeric_limits<float>::max();
    double x0_m_, y0_m_, per_m_, columns_, rows_;
    std::int32_t stride_;
    Cell* cells_;
};

constexpr std::int64_t kBlock = 16;  // about as many cells as the processor can load at once

struct Block {
    std::int32_t at[kBlock];  // -1: no hit
    float z[kBlock];
};

// Adds `count` hits in their order; find(first, size, block) finds those from `first` on. While the hits of one block are
// added, the cells of the next are being loaded.
template <typename Find>
inline void add_all(const Hits& hits, std::int64_t count, const Find& find) {
    Block blocks[2];
    const auto find_block = [&](std::int64_t first, Block& block) {
        const std::int64_t size = std::clamp<std::int64_t>(count - first, 0, kBlock);
        find(first, size, block);
        std::fill(block.at + size, block.at + kBlock, -1);
    };
    find_block(0, blocks[0]);
    for (std::int64_t first = 0; first < count; first += kBlock) {
        const std::int64_t turn = first / kBlock % 2;
        const Block& now = blocks[turn];
        Block& next = blocks[1 - turn];
        find_block(first + kBlock, next);
        for (std::int64_t k = 0; k < kBlock; ++k) {
            hits.fetch(next.at[k]);
            if (now.at[k] >= 0) hits.add(now.at[k], now.z[k]);
        }
    }
}

inline bool inside(const double* p, const double* box) {
    return p[0] >= box[0] && p[1] >= box[1] && p[2] >= box[2] && p[0] <= box[3] && p[1] <= box[4] && p[2] <= box[5];
}

// Boxes of the rover itself. A test against the bounds of all boxes avoids the other tests for nearly every hit.
class Hull {
public:
    explicit Hull(const Mount& mount) : boxes_(mount.hull_m), count_(mount.boxes) {
        for (int k = 0; k < 3; ++k) {
            bounds_[k] = std::numeric_limits<double>::infinity();
            bounds_[3 + k] = -bounds_[k];
            for (std::int64_t at = 0; at < count_; ++at) {
                bounds_[k] = std::min(bounds_[k], boxes_[6 * at + k]);
                bounds_[3 + k] = std::max(bounds_[3 + k], boxes_[6 * at + 3 + k]);
            }
        }
    }

    bool holds(double x, double y, double z) const {
        const double p[3] = {x, y, z};
        if (!inside(p, bounds_)) return false;
        for (std::int64_t at = 0; at < count_; ++at)
            if (inside(p, boxes_ + 6 * at)) return true;
        return false;
    }

private:
    const double* boxes_;
    std::int64_t count_;
    double bounds_[6];
};

inline float mapped(const double* row, double x, double y, double z) {
    return static_cast<float>(row[0] * x + row[1] * y + row[2] * z + row[3]);
}

}  // namespace detail

// Adds points (count, 3) in map axes to `cells`.
inline void add_points(const RasterGrid& grid, const float* points_m, std::int64_t count, Cell* cells) {
    const detail::Hits hits(grid, cells);
    detail::add_all(hits, count, [&](std::int64_t first, std::int64_t size, detail::Block& block) {
        const float* p = points_m + 3 * first;
        for (std::int64_t k = 0; k < size; ++k) {
            block.at[k] = hits.at(p[3 * k], p[3 * k + 1], p[3 * k + 2]);
            block.z[k] = p[3 * k + 2];
        }
    });
}

// Adds the hits of one turn to `cells`: p_map = T_map_base (scanner + R_y(tilt) range (cos azimuth, sin azimuth, 0)).
inline void add_turn(const RasterGrid& grid, const Turn& turn, const Mount& mount, Cell* cells) {
    const detail::Hits hits(grid, cells);
    const detail::Hull hull(mount);
    const double *T = mount.T_map_base, *scanner = mount.scanner_m;
    detail::add_all(hits, turn.count, [&](std::int64_t first, std::int64_t size, detail::Block& block) {
        const float* ranges = turn.ranges_m + first;
        const double *azimuth = turn.azimuths + first, *tilt = turn.tilts + first;
        double x[detail::kBlock], y[detail::kBlock], z[detail::kBlock];
        for (std::int64_t k = 0; k < size; ++k) {
            const double ahead = ranges[k] * azimuth[k];
            x[k] = ahead * tilt[k] + scanner[0];
            y[k] = ranges[k] * azimuth[turn.count + k] + scanner[1];
            z[k] = -ahead * tilt[turn.count + k] + scanner[2];
            block.z[k] = detail::mapped(T + 8, x[k], y[k], z[k]);
            const float east = detail::mapped(T, x[k], y[k], z[k]), north = detail::mapped(T + 4, x[k], y[k], z[k]);
            const std::int32_t cell = hits.at(east, north, block.z[k]);
            block.at[k] = ranges[k] <= turn.longest_m ? cell : -1;
        }
        for (std::int64_t k = 0; k < size; ++k)
            if (block.at[k] >= 0 && hull.holds(x[k], y[k], z[k])) block.at[k] = -1;
    });
}

}  // namespace eldorado
