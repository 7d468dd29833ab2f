// A way out of the probe: takes encoded descriptors and never makes the estimator wait.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

/// One descriptor as it goes over every wire: encoded once, shared, never changed.
using EncodedDescriptor = std::shared_ptr<const std::vector<std::byte>>;

/// What a link can say of its listeners.
struct LinkCounters {
  std::uint32_t clients = 0;
  std::uint64_t coalesced = 0;  ///< Descriptors that a slow listener did not get because a newer one came.
  std::uint64_t messages_refused =
      0;  ///< From outside: no message, never whole, damaged, too large, not for us, played again or too many.
  std::uint64_t authentication_failures = 0;  ///< Calls of nobody that the probe knows.
  std::uint64_t client_list_faults = 0;       ///< Changes of the list of clients that could not be read.
};

class Link {
 public:
  virtual ~Link() = default;

  /// resource_exhausted or unavailable where the port or device cannot be had, naming it and the remedy.
  [[nodiscard]] virtual Status start() = 0;
  /// Called from the one publishing thread, between start() and stop(). Queues and returns: a full queue loses its
  /// oldest entry, counted.
  virtual void publish(const EncodedDescriptor& descriptor) = 0;
  /// After it returns no client is served any more. Bounded: at most a second.
  virtual void stop() = 0;

  [[nodiscard]] virtual LinkCounters counters() const = 0;
  /// Where clients reach it, "grpc://127.0.0.1:7420". Known after start().
  [[nodiscard]] virtual std::string address() const = 0;
  /// What is wrong at the moment, for a person; empty while all is well. A link that needs a third party (a broker)
  /// starts without it and says so here; one whose files were damaged goes on with what it read before and says so.
  [[nodiscard]] virtual std::string error_message() const { return {}; }
};

}  // namespace lightwell
