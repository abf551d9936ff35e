// Tables, computed by the compiler, of the steps that a path over a grid may take and those that it must take.
//
// Where all steps of a kind cost the same, most paths have an equivalent: of straight then diagonal and diagonal then
// straight only the second must be followed, and no path needs two steps where one is enough (Harabor and Grastien
// 2011). A path that came straight then continues straight only, one that came diagonally to three cells; an adjacent
// obstacle that blocks the equivalent path adds the cell behind that obstacle.
#pragma once

#include <cstdint>

namespace eldorado {

// The 8 neighbours, row by row: bit k of a set of neighbours is the k-th.
struct GridStep {
    int down, right;
    constexpr bool diagonal() const { return down != 0 && right != 0; }
};
constexpr GridStep kGridSteps[8] = {{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}, {0, 1}, {1, -1}, {1, 0}, {1, 1}};

constexpr unsigned grid_bit(int down, int right) {
    unsigned bit = 0;
    for (int k = 0; k < 8; ++k)
        if (kGridSteps[k].down == down && kGridSteps[k].right == right) bit = 1u << k;
    return bit;
}

// The neighbours to which a step may lead if `free` are free: not diagonally between two that are not.
constexpr unsigned grid_open(unsigned free) {
    unsigned open = 0;
    for (const GridStep& s : kGridSteps)
        if (!s.diagonal() || (free & (grid_bit(s.down, 0) | grid_bit(0, s.right))) != 0) open |= grid_bit(s.down, s.right);
    return open & free;
}

// The neighbours to which a path that came by step `s` must continue.
constexpr unsigned grid_onward(GridStep s, unsigned free) {
    unsigned on = grid_bit(s.down, s.right);
    if (s.diagonal()) {
        on |= grid_bit(s.down, 0) | grid_bit(0, s.right);
        if ((free & grid_bit(-s.down, 0)) == 0) on |= grid_bit(-s.down, s.right);
        if ((free & grid_bit(0, -s.right)) == 0) on |= grid_bit(s.down, -s.right);
    } else {
        for (int side = -1; side <= 1; side += 2) {
            const int down = side * s.right, right = side * s.down;
            if ((free & grid_bit(down, right)) == 0) on |= grid_bit(s.down + down, s.right + right);
        }
    }
    return on & grid_open(free);
}

struct GridWays {
    std::uint8_t open[256], onward[8][256];  // by the free neighbours of a cell
};

constexpr GridWays grid_ways() {
    GridWays ways{};
    for (unsigned free = 0; free < 256; ++free) {
        ways.open[free] = static_cast<std::uint8_t>(grid_open(free));
        for (int k = 0; k < 8; ++k) ways.onward[k][free] = static_cast<std::uint8_t>(grid_onward(kGridSteps[k], free));
    }
    return ways;
}

inline constexpr GridWays kGridWays = grid_ways();

}  // namespace eldorado
