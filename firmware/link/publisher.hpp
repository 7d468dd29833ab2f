// Encodes each descriptor once and passes the bytes to all links.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/descriptor.hpp>

#include "link/link.hpp"

namespace lightwell {

/// publish() is called from one thread. All links are added before the first publish().
class Publisher {
 public:
  void add(std::unique_ptr<Link> link) { links_.push_back(std::move(link)); }

  /// Starts all links in order. If one fails, stops those already started and returns its status.
  [[nodiscard]] Status start();
  void stop();

  /// Sets time.encoded_after of `descriptor`, encodes it (without allocation up to this point) and passes it to the
  /// links.
  [[nodiscard]] Status publish(Descriptor& descriptor);
  /// CLOCK_MONOTONIC, ns, when the last descriptor was encoded, before it was passed to a link.
  [[nodiscard]] std::int64_t encoded_ns() const { return encoded_ns_; }

  /// Sums over all links.
  [[nodiscard]] LinkCounters counters() const;
  [[nodiscard]] const std::vector<std::unique_ptr<Link>>& links() const { return links_; }

 private:
  Encoder encoder_;
  std::int64_t encoded_ns_ = 0;
  std::vector<std::unique_ptr<Link>> links_;
};

}  // namespace lightwell
