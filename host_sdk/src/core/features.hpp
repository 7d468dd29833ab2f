// The parts of the SDK that a build may lack.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace lightwell::core {

enum class Built : std::uint8_t { yes, no };

struct Feature {
  std::string_view name;     ///< "grpc://".
  std::string_view package;  ///< Debian package without which it is not built.
  Built built = Built::no;
};

/// All of them: grpc:// and pairing, ws://, mqtt://, usb:, discovery by mDNS.
[[nodiscard]] std::array<Feature, 5> features();

}  // namespace lightwell::core
