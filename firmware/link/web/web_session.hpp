// One WebSocket of a client: its requests, and what is to be sent to it. Without network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lightwell/commands.hpp>

#include "link/link.hpp"
#include "link/plane_queue.hpp"
#include "link/token_bucket.hpp"

namespace lightwell {

/// Larger requests are refused; the largest valid request has a few hundred bytes.
inline constexpr std::size_t kMaxWebRequestBytes = 4096;

enum class WebStream { descriptors, planes };
/// Whether the handshake has authenticated the client.
enum class WebAdmission { accepted, pending };

/// Why a WebSocket is closed: a code of RFC 6455, section 7.4.1, and a text of at most 123 bytes.
struct WebClose {
  std::uint16_t code = 0;
  std::string_view reason;
};

/// What a session calls; both outlive it.
struct WebSessionHost {
  Commands& commands;
  /// Whether the token is that of a client; counts one that is not.
  std::function<bool(const std::string& token)> accepts_token;
};

/// Part of a WebSocket message as a server receives it.
struct WebFragment {
  std::span<const std::byte> bytes;
  bool is_text = false;  ///< Text, not binary.
  bool is_last = true;   ///< The message ends with it.
};

/// Collects the fragments of requests, executes requests, and keeps what is to be sent: responses, and the newest
/// descriptor or plane. One thread.
class WebSession {
 public:
  /// Requests that a client may make at once, and each second.
  static constexpr double kRequestBurst = 50, kRequestsPerSecond = 50;
  /// Fragments of a request.
  static constexpr int kMaxFragments = 64;
  /// Responses that may wait to be sent; wants_input() is false from half of them on.
  static constexpr std::size_t kMaxResponses = 8;

  WebSession(WebStream stream, WebAdmission admission, WebSessionHost host)
      : stream_(stream), admission_(admission), host_(std::move(host)) {}

  /// Takes the next fragment; a value if the connection must be closed. Executes the request that it completes.
  [[nodiscard]] std::optional<WebClose> receive(const WebFragment& fragment, std::int64_t now_ns);
  /// Whether the client may send more before a response is sent.
  [[nodiscard]] bool wants_input() const { return responses_.size() < kMaxResponses / 2; }

  [[nodiscard]] WebStream stream() const { return stream_; }
  /// Nothing may be offered before.
  [[nodiscard]] bool accepted() const { return admission_ == WebAdmission::accepted; }

  /// To be sent in place of one that waits: then true.
  bool offer(const EncodedDescriptor& descriptor);
  /// To be sent when the update before is sent. If another one waits, the client lacks that, and receives this one
  /// whole.
  void offer(const std::shared_ptr<const EncodedPlane>& plane) { planes_.put(plane); }

  /// The next message to be sent, empty if there is none. Valid until the next call.
  [[nodiscard]] std::span<const std::byte> next();
  [[nodiscard]] bool has_next() const { return !responses_.empty() || descriptor_ || !planes_.empty(); }

  /// Number of requests that were refused: too large, too frequent, malformed, or text.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  [[nodiscard]] std::optional<WebClose> execute(std::int64_t now_ns);
  [[nodiscard]] std::optional<WebClose> refuse(std::uint16_t code, std::string_view reason);

  const WebStream stream_;
  WebAdmission admission_;
  const WebSessionHost host_;
  TokenBucket requests_{kRequestsPerSecond, kRequestBurst};
  std::vector<std::byte> request_;  ///< Fragments so far.
  int fragments_ = 0;
  std::deque<std::vector<std::byte>> responses_;
  std::vector<std::byte> sending_response_;
  EncodedDescriptor descriptor_, sending_descriptor_;
  PlaneQueue planes_;
  EncodedMessage sending_plane_;
  std::uint64_t refused_ = 0;
};

/// The same reason for every failure of the authentication, so that none can be told from another.
inline constexpr std::string_view kWebNotAuthenticated =
    "not authenticated: pair with this probe (`lightwelld --pair` there, `lightwell pair` here)";

}  // namespace lightwell
