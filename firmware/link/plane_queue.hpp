// The messages of captured planes that a link has yet to send to one client, or to its broker.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "link/link.hpp"

namespace lightwell {

/// Sends an update message by message, and keeps one more. An update that is replaced before its first message was sent
/// is lost; the next one is then sent whole, as is the first. Allocates nothing. One thread at a time.
class PlaneQueue {
 public:
  /// Queues an update; it replaces one of which nothing was sent yet.
  void put(std::shared_ptr<const EncodedPlane> plane);
  /// Takes the next message; null if there is none. It shares the ownership of its update.
  [[nodiscard]] EncodedMessage take();
  [[nodiscard]] bool empty() const { return !current_ && !next_; }
  /// The client may lack messages: what follows the present update is sent whole.
  void require_whole() { needs_whole_ = true; }
  /// Discards all messages; the next update is sent whole.
  void clear();
  /// Updates that were replaced.
  [[nodiscard]] std::uint64_t replaced() const { return replaced_; }

 private:
  std::shared_ptr<const EncodedPlane> current_;       ///< Null between two updates.
  const EncodedPlane::Messages* messages_ = nullptr;  ///< Of current_: its changes or the whole.
  std::size_t sent_ = 0;                              ///< Number of messages_ that were taken.
  std::shared_ptr<const EncodedPlane> next_;          ///< Follows current_; null: none.
  bool needs_whole_ = true;
  std::uint64_t replaced_ = 0;
};

}  // namespace lightwell
