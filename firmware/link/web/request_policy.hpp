// Decisions on HTTP requests that need no network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/config.hpp>

#include "link/token_bucket.hpp"

namespace lightwell {

enum class WebMethod { get, head, other };

/// The request line and headers that the link uses; missing and overlong ones are empty.
struct WebRequest {
  WebMethod method = WebMethod::other;
  std::string path;  ///< Decoded, without the query.
  bool has_query = false;
  std::string host, origin, authorization, protocols, if_none_match;
  bool has_authorization = false;  ///< Also if it is overlong.
};

/// Whether a page of `origin` (a request's header; empty: none) may use a server that the request calls `host`: the
/// page is of this server, or `allowed` has its origin.
[[nodiscard]] bool is_origin_allowed(std::string_view origin, std::string_view host,
                                     std::span<const std::string> allowed);

/// For links in plain text, where no token is needed: whether `host` of a request is a name that a stranger's DNS
/// server cannot give to this machine (DNS rebinding): an IP address, localhost, a name in .local or without a dot, or
/// a host of `allowed`.
[[nodiscard]] bool is_host_trusted(std::string_view host, std::span<const std::string> allowed);

/// By the extension; empty: files of this type are not served.
[[nodiscard]] std::string_view content_type_of(std::string_view path);

/// Limits failed authentications from an address: ten at once, one a second for long. Addresses share 256 counters, so
/// its memory is fixed; two that share one limit each other. One thread.
class AuthenticationLimit {
 public:
  /// Whether an attempt from `address` is allowed.
  [[nodiscard]] bool allows(std::string_view address, std::int64_t now_ns) {
    return counter(address).available(now_ns);
  }
  void count_failure(std::string_view address, std::int64_t now_ns) { (void)counter(address).take(now_ns); }

 private:
  static constexpr std::size_t kCounters = 256;
  [[nodiscard]] TokenBucket& counter(std::string_view address);

  std::vector<TokenBucket> counters_ = std::vector<TokenBucket>(kCounters, TokenBucket(1, 10));
};

}  // namespace lightwell
