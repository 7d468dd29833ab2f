// The checksum of recordings, environment maps and link frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace lightwell {

/// CRC-32C (Castagnoli), as in RFC 3720 B.4. `seed`: the checksum of the preceding bytes, for incremental use.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t seed = 0);

}  // namespace lightwell
