// Free poses that are connected with a given one. No Python types, no exceptions, no heap.
//
// A flood fill over cells: the 8 orientations of a cell are the bits of a byte, so one visit propagates all of them.
#pragma once

#include <cstdint>

#include "pose_field.hpp"

namespace eldorado {

// Owned by the caller, each with cells_needed(): free and found zero, a stack.
struct ReachableWork {
    std::uint8_t *free, *found, *waiting;
    std::int32_t* stack;
};

class Reachable {
   public:
    static std::int64_t cells_needed(std::int64_t rows, std::int64_t columns) { return (rows + 2) * (columns + 2); }

    Reachable(std::int64_t rows, std::int64_t columns, const ReachableWork& work)
        : rows_(rows), columns_(columns), stride_(columns + 2), w_(work) {}

    // freedom (8, rows, columns): poses of value `free` are free; start at (j, i, o). reached: 1 or 0, the same shape.
    void run(const std::uint8_t* freedom, std::uint8_t free, std::int64_t j, std::int64_t i, int o, std::uint8_t* reached) {
        const std::int64_t layer = rows_ * columns_;
        for (int k = 0; k < kOrientations; ++k)
            for (std::int64_t row = 0; row < rows_; ++row)
                for (std::int64_t column = 0; column < columns_; ++column)
                    w_.free[padded(row, column)] |=
                        static_cast<std::uint8_t>((freedom[k * layer + row * columns_ + column] == free) << k);
        offer(padded(j, i), static_cast<std::uint8_t>(1u << o));
        while (top_ > 0) expand(w_.stack[--top_]);
        for (int k = 0; k < kOrientations; ++k)
            for (std::int64_t row = 0; row < rows_; ++row)
                for (std::int64_t column = 0; column < columns_; ++column)
                    reached[k * layer + row * columns_ + column] = w_.found[padded(row, column)] >> k & 1;
    }

   private:
    std::int64_t padded(std::int64_t j, std::int64_t i) const { return (j + 1) * stride_ + i + 1; }

    // Queues the orientations of a cell that are free and new.
    void offer(std::int64_t cell, std::uint8_t poses) {
        const auto fresh = static_cast<std::uint8_t>(poses & w_.free[cell] & ~w_.found[cell]);
        if (fresh == 0) return;
        if (w_.waiting[cell] == 0) w_.stack[top_++] = static_cast<std::int32_t>(cell);
        w_.waiting[cell] |= fresh;
        w_.found[cell] |= fresh;
    }

    void expand(std::int64_t cell) {
        const std::uint8_t poses = turned(w_.waiting[cell], w_.free[cell]);
        w_.waiting[cell] = 0;
        w_.found[cell] |= poses;
        for (const std::int64_t way : {std::int64_t{1}, stride_ + 1, stride_, stride_ - 1}) {
            offer(cell + way, poses);
            offer(cell - way, poses);
        }
    }

    // Orientations that turning on the spot over free orientations reaches.
    static std::uint8_t turned(unsigned poses, unsigned free) {
        for (unsigned before = 0; before != poses;) {
            before = poses;
            poses |= (poses << 1 | poses >> 7 | poses >> 1 | poses << 7) & free;
        }
        return static_cast<std::uint8_t>(poses);
    }

    const std::int64_t rows_, columns_, stride_;
    const ReachableWork w_;
    std::int64_t top_ = 0;
};

}  // namespace eldorado
