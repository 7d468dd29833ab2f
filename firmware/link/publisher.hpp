// Encodes a descriptor once and hands the bytes to every link.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/descriptor.hpp>

#include "link/link.hpp"

namespace lightwell {

/// One thread publishes. Links are added before the first publish().
class Publisher {
 public:
  void add(std::unique_ptr<Link> link) { links_.push_back(std::move(link)); }

  /// Starts every link; the first that fails stops those before it.
  [[nodiscard]] Status start();
  void stop();

  /// Stamps `descriptor` with the time of encoding, encodes it (no allocation up to here) and gives it to the links.
  [[nodiscard]] Status publish(Descriptor& descriptor);
  /// CLOCK_MONOTONIC when the bytes of the last descriptor were there, before any link had them.
  [[nodiscard]] std::int64_t encoded_ns() const { return encoded_ns_; }

  /// Over all links.
  [[nodiscard]] LinkCounters counters() const;
  [[nodiscard]] const std::vector<std::unique_ptr<Link>>& links() const { return links_; }

 private:
  Encoder encoder_;
  std::int64_t encoded_ns_ = 0;
  std::vector<std::unique_ptr<Link>> links_;
};

}  // namespace lightwell
