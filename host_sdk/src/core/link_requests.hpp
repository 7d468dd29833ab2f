// Pending requests of a link whose requests are messages (USB, WebSocket).
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <lightwell/link_message.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// Pending requests. Shared by any threads, which make requests and wait, and one reader thread, which sends them and
/// receives responses.
class LinkRequests {
 public:
  /// Queues a request and waits for the response. unavailable if there is none within `timeout`, or the link is down or
  /// breaks. `wake` notifies the reader thread.
  [[nodiscard]] Result<LinkResponse> send_request(const LinkCommand& command, Duration timeout,
                                                  const std::function<void()>& wake) {
    std::unique_lock lock(mutex_);
    if (!up_) return Status(StatusCode::unavailable, "not connected");
    const std::uint32_t id = next_id_++;
    PendingRequest& pending = requests_[id];
    encode_link_request(id, command, pending.request);
    lock.unlock();
    wake();
    lock.lock();
    (void)changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return pending.answer.has_value(); });
    const std::optional<Result<LinkResponse>> answer = std::move(pending.answer);
    requests_.erase(id);
    return answer ? *answer : Status(StatusCode::unavailable, "the probe did not respond in time");
  }

  // Called by the reader thread.

  [[nodiscard]] std::uint32_t new_id() {
    const std::lock_guard lock(mutex_);
    return next_id_++;
  }
  /// Writes the next unsent request into `out` and returns its id; no value if there is none.
  [[nodiscard]] std::optional<std::uint32_t> next(std::vector<std::byte>& out) {
    const std::lock_guard lock(mutex_);
    for (auto& [id, q] : requests_) {
      if (q.sent || q.answer) continue;
      q.sent = true;
      out = q.request;
      return id;
    }
    return std::nullopt;
  }
  /// Whether next() would return a request.
  [[nodiscard]] bool has_unsent() {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(requests_, [](const auto& entry) { return !entry.second.sent && !entry.second.answer; });
  }
  void answered(const LinkResponse& response) {
    const std::lock_guard lock(mutex_);
    const auto found = requests_.find(response.id);
    if (found != requests_.end() && found->second.sent && !found->second.answer) found->second.answer = response;
    changed_.notify_all();
  }
  void link_up() {
    const std::lock_guard lock(mutex_);
    up_ = true;
  }
  /// All pending requests fail. It is unknown whether the probe executed those that were sent.
  void link_down() {
    const std::lock_guard lock(mutex_);
    up_ = false;
    for (auto& [id, q] : requests_)
      if (!q.answer) q.answer = Status(StatusCode::unavailable, "the connection was lost before the probe responded");
    changed_.notify_all();
  }

 private:
  struct PendingRequest {
    std::vector<std::byte> request;
    bool sent = false;
    std::optional<Result<LinkResponse>> answer;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint32_t, PendingRequest> requests_;  ///< By id; at most one per waiting thread.
  std::uint32_t next_id_ = 1;
  bool up_ = false;
};

}  // namespace lightwell::core
