// A link that counts descriptors: step 2 of "A link" in CONTRIBUTING.md.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include <lightwell/commands.hpp>

#include "link/link.hpp"

namespace lightwell {

/// Step 1, without the message of config.proto. In the tree the struct is in lightwell/config.hpp.
struct CountConfig {
  std::string name;
};

class CountLink : public Link {
 public:
  /// Descriptors since the construction. Any thread.
  [[nodiscard]] virtual std::uint64_t count() const = 0;
};

/// `commands` must outlive the link; it is not called, because a count has no clients.
[[nodiscard]] std::unique_ptr<CountLink> make_count_link(const CountConfig& config, Commands& commands);

}  // namespace lightwell
