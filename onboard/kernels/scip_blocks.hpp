// Data blocks of a SCIP scan (protocol/scip/blocks.py): 64 characters, their sum, an LF; the last block has the
// remaining 1 to 64 characters and no LF. A value has some characters of 6 bits, high bits first, and may cross block
// borders.
#pragma once

#include <cstdint>

namespace eldorado {

constexpr std::int64_t SCIP_BLOCK = 64;

// Reads the values of the blocks in `text` (size bytes). Returns false, with `values` undefined, unless sizes, sums,
// LFs and the range of every character are right. count, characters > 0.
inline bool scip_values(const std::uint8_t* text, std::int64_t size, std::int64_t characters, std::int64_t* values,
                        std::int64_t count) {
    const std::int64_t whole = (count * characters - 1) / SCIP_BLOCK;
    const std::int64_t rest = count * characters - whole * SCIP_BLOCK;
    if (size != whole * (SCIP_BLOCK + 2) + rest + 1) return false;
    std::int64_t value = 0, have = 0;
    unsigned wrong = 0;
    for (std::int64_t block = 0; block <= whole; ++block) {
        const std::int64_t length = block < whole ? SCIP_BLOCK : rest;
        unsigned sum = 0;
        for (std::int64_t k = 0; k < length; ++k) {
            const unsigned six = static_cast<unsigned>(text[k]) - 0x30u;
            wrong |= six;
            sum += text[k];
            value = value << 6 | static_cast<std::int64_t>(six & 0x3Fu);
            if (++have == characters) {
                *values++ = value;
                value = have = 0;
            }
        }
        wrong |= ((sum & 0x3Fu) + 0x30u) == text[length] ? 0u : 0x40u;
        if (block < whole) wrong |= text[length + 1] == '\n' ? 0u : 0x40u;
        text += length + 2;
    }
    return wrong <= 0x3Fu;
}

}  // namespace eldorado
