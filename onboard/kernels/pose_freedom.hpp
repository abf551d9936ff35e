// Freedom of poses (8 orientations, rows, columns): free, blocked or unknown. The rules and their reasons are in
// onboard/planning/local/poses.py. No Python types, no exceptions, no heap.
//
// The ground is padded by the rover's reach, so a wheel or a cell under the body is one load for kLanes adjacent poses.
// Most bodies clear the highest cell under them: only the others are compared with the plane cell by cell.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "elementary.hpp"
#include "ground_rules.hpp"
#include "pose_field.hpp"
#include "simd.hpp"

namespace eldorado {

enum Freedom : std::uint8_t { kBlocked, kUnknown, kFree };  // poses.Freedom

// The cells under the rover, relative to the cell of base_link.
struct Footprint {
    const std::int32_t* wheels;  // (8, 4, 2): dj, di of wheels 1 to 4 per orientation; 1 is opposite 3, 2 opposite 4
    // (body_rows, 6) by rising orientation: orientation, dj, first and last di under the body (first > last: none), first and
    // last di that it may touch.
    const std::int32_t* body;
    std::int64_t body_rows;
};

// One cell under the rover; `by`: its offset in the padded ground.
struct CellUnder {
    std::int64_t by;
    float dj, di;
};

struct PoseLimits {
    float tilt_ratio, slope_ratio, belly_m, cell_m;
};

class PoseFreedom {
   public:
    // `under`: workspace of `needed` cells.
    PoseFreedom(const Ground& ground, const Footprint& print, const PoseLimits& limits, CellUnder* under)
        : g_(ground), f_(print), l_(limits), stride_(ground.stride()), under_(under) {}

    // Most cells under the body and that it may touch, of all orientations, for any overlap of the two.
    static std::int64_t needed(const Footprint& print) {
        std::int64_t cells = 0;
        for (const std::int32_t* row = print.body; row < print.body + kBodyRow * print.body_rows; row += kBodyRow)
            cells += std::max(0, row[3] - row[2] + 1) + 2 * std::max(0, row[5] - row[4] + 1);
        return cells;
    }

    void run(std::uint8_t* freedom) const {
        const std::int32_t *body = f_.body, *const last = f_.body + kBodyRow * f_.body_rows;
        CellUnder* end = under_;
        for (int o = 0; o < kOrientations; ++o) {
            Orientation way(o, *this);
            const std::int32_t* const rows = body;
            while (body < last && body[0] == o) body += kBodyRow;
            way.first = end;
            for (const std::int32_t* row = rows; row < body; row += kBodyRow) end = list(row, row[2], row[3], end);
            way.beside = end;
            for (const std::int32_t* row = rows; row < body; row += kBodyRow) {
                end = list(row, row[4], std::min(row[5], row[2] - 1), end);
                end = list(row, std::max(row[4], row[3] + 1), row[5], end);
            }
            way.last = end;
            for (std::int64_t j = 0; j < g_.rows; ++j)
                for (std::int64_t i = 0; i < g_.columns; i += kLanes) {
                    const Bytes found = __builtin_convertvector(judge(way, g_.at(j, i)), Bytes);
                    const std::int64_t count = std::min<std::int64_t>(kLanes, g_.columns - i);
                    std::memcpy(freedom + (o * g_.rows + j) * g_.columns + i, &found, static_cast<std::size_t>(count));
                }
        }
    }

   private:
    static constexpr std::int64_t kBodyRow = 6;

    typedef std::uint8_t Bytes __attribute__((vector_size(kLanes)));

    // Constants of all poses of one orientation.
    struct Orientation {
        Orientation(int o, const PoseFreedom& of) {
            const std::int32_t* const wheels = of.f_.wheels + 8 * o;
            for (int k = 0; k < 4; ++k) wheel[k] = wheels[2 * k] * of.stride_ + wheels[2 * k + 1];
            const std::int64_t y1 = wheels[0], x1 = wheels[1], y2 = wheels[2], x2 = wheels[3];
            first_x = static_cast<float>(x1);
            first_y = static_cast<float>(y1);
            second_x = static_cast<float>(x2);
            second_y = static_cast<float>(y2);
            per_area = static_cast<float>(1.0 / static_cast<double>(x1 * y2 - x2 * y1));
            cosine = static_cast<float>(elementary::cos(o * elementary::kPi / kOrientations));
            sine = static_cast<float>(elementary::sin(o * elementary::kPi / kOrientations));
        }

        std::int64_t wheel[4];
        float first_x, first_y, second_x, second_y, per_area, cosine, sine;
        const CellUnder *first, *beside, *last;  // under the body from `first` on, what else it may touch from `beside` on
    };

    // The plane of the wheels: height at the centre, slopes along +x and +y per cell; NaN if a height is unknown.
    struct Plane {
        Floats middle, slope_x, slope_y;
    };

    // Writes cells first to last of a row at `end`; returns the end after them.
    CellUnder* list(const std::int32_t* row, std::int32_t first, std::int32_t last, CellUnder* end) const {
        for (std::int32_t di = first; di <= last; ++di)
            *end++ = {row[1] * stride_ + di, static_cast<float>(row[1]), static_cast<float>(di)};
        return end;
    }

    static Floats size_of(Floats v) { return v < 0.0f ? -v : v; }

    // Freedom of kLanes adjacent poses.
    Ints judge(const Orientation& way, std::int64_t at) const {
        Ints flags = all(kWhole | kSmooth);
        for (const std::int64_t wheel : way.wheel) flags &= load(g_.flags + at + wheel);
        const Plane plane = plane_of(way, at);
        const Floats along = (plane.slope_x * way.cosine + plane.slope_y * way.sine) / l_.cell_m;
        const Floats across = (plane.slope_y * way.cosine - plane.slope_x * way.sine) / l_.cell_m;
        Ints blocked = ((flags & kSmooth) == 0) | (size_of(along) > l_.tilt_ratio) | (size_of(across) > l_.tilt_ratio);
        const Ints steep = (load(g_.flags + at) & kGentle) == 0;
        if (any(steep))
            for (int lane = 0; lane < kLanes; ++lane)
                if (steep[lane] && static_cast<float>(elementary::hypot(along[lane], across[lane])) > l_.slope_ratio)
                    blocked[lane] = -1;

        const Floats limit = plane.middle + l_.belly_m;
        Ints vouched = limit == limit;
        const Ints open = vouched & ~blocked;
        if (any(open) && any(open & ~(bound_under(way, plane, at) < limit)))
            look_under(way, plane, limit, at, &blocked, &vouched);
        const Ints free = vouched & ((flags & kWhole) != 0);
        return blocked ? all(static_cast<std::int32_t>(kBlocked))
                       : free ? all(static_cast<std::int32_t>(kFree)) : all(static_cast<std::int32_t>(kUnknown));
    }

    Plane plane_of(const Orientation& way, std::int64_t at) const {
        const Floats z1 = load(g_.z + at + way.wheel[0]), z2 = load(g_.z + at + way.wheel[1]);
        const Floats z3 = load(g_.z + at + way.wheel[2]), z4 = load(g_.z + at + way.wheel[3]);
        const Floats first = (z1 - z3) * 0.5f, second = (z2 - z4) * 0.5f;
        return {(z1 + z2 + z3 + z4) * 0.25f, (first * way.second_y - second * way.first_y) * way.per_area,
                (second * way.first_x - first * way.second_x) * way.per_area};
    }

    // Upper bound of the result of `look_under`: the highest cell that the body may touch over the plane's lowest point
    // within reach. Rounding preserves the order of numbers, so the bound is exact to the last bit.
    Floats bound_under(const Orientation& way, const Plane& plane, std::int64_t at) const {
        Floats highest = all(-std::numeric_limits<float>::infinity());
        for (const CellUnder* cell = way.first; cell < way.last; ++cell)
            highest = larger(load(g_.over + at + cell->by), highest);
        const auto reach = static_cast<float>(g_.reach);
        return highest + (size_of(plane.slope_x) * reach + size_of(plane.slope_y) * reach);
    }

    // Blocked: a known cell under the body is above the limit. Not vouched: a beam is, over an unknown cell that it may
    // touch.
    void look_under(const Orientation& way, const Plane& plane, Floats limit, std::int64_t at, Ints* blocked,
                    Ints* vouched) const {
        for (const CellUnder* cell = way.first; cell < way.last; ++cell) {
            const Floats ground = plane.slope_x * cell->di + plane.slope_y * cell->dj;
            if (cell < way.beside) *blocked |= load(g_.top + at + cell->by) - ground > limit;
            *vouched &= load(g_.ray + at + cell->by) - ground <= limit;
        }
    }

    const Ground g_;
    const Footprint f_;
    const PoseLimits l_;
    const std::int64_t stride_;
    CellUnder* const under_;
};

}  // namespace eldorado
