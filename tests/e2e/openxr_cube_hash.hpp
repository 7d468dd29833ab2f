// The hash of a cube map as light_client prints it.
#pragma once

#include <cinttypes>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/cube_map.hpp>

namespace lightwell::test {

inline std::string fnv_1a(const std::vector<std::byte>& bytes) {
  std::uint64_t hash = 14695981039346656037U;
  for (const std::byte b : bytes) hash = (hash ^ static_cast<std::uint64_t>(b)) * 1099511628211U;
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, hash);
  return text;
}

/// The six buffers of an application from those of cube_map(): its -Z is the front, and its +Z the back. `kept`: bytes
/// of each texel, without the alpha of R32G32B32.
[[nodiscard]] inline std::string hash_of_cube(const Lighting& light, const CubeMapOptions& options, std::size_t texel,
                                              std::size_t kept) {
  std::vector<std::byte> texels(cube_map_bytes(options.edge, options.format)), out;
  EXPECT_NE(cube_map(light, options, texels).validity, Validity::invalid_query);
  const std::size_t face = texels.size() / 6;
  for (const std::size_t f : {0U, 1U, 2U, 3U, 5U, 4U})
    for (std::size_t i = 0; i < face; i += texel) {
      const auto first = texels.begin() + static_cast<std::ptrdiff_t>(f * face + i);
      out.insert(out.end(), first, first + static_cast<std::ptrdiff_t>(kept));
    }
  return fnv_1a(out);
}

}  // namespace lightwell::test
