// Which HTTP requests and tokens the web link accepts.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "link/access/call_authorizer.hpp"
#include "link/web/request_policy.hpp"
#include "link/web/web_session.hpp"

namespace lightwell {

/// Whether a client without credentials may send a token in its first message.
enum class LateToken { allowed, refused };

/// A status other than 200 is the response, with `text` for people.
struct WebDecision {
  int status = 200;
  std::string_view text{};
  WebAdmission admission = WebAdmission::accepted;
};

/// Checks Origin, Host, tokens and certificates, and limits and counts failures. One thread.
class WebAuthorizer {
 public:
  /// `calls` is null for a link in plain text, which needs no token.
  WebAuthorizer(std::vector<std::string> allowed_origins, std::shared_ptr<CallAuthorizer> calls)
      : allowed_origins_(std::move(allowed_origins)), calls_(std::move(calls)) {}

  /// `peer`: the client's address. `certificate`: PEM, checked by the handshake; empty without one.
  [[nodiscard]] WebDecision check(const WebRequest& request, std::string_view peer, std::string_view certificate,
                                  LateToken late_token, std::int64_t now_ns);
  /// A token of a first message; empty: there was none.
  [[nodiscard]] bool accepts_token(std::string_view peer, const std::string& token, std::int64_t now_ns);

 private:
  /// nullptr, or the reason of the denial, which is counted.
  [[nodiscard]] const char* denial_reason(std::string_view peer, const CallCredentials& credentials,
                                          std::int64_t now_ns);

  const std::vector<std::string> allowed_origins_;
  const std::shared_ptr<CallAuthorizer> calls_;
  AuthenticationLimit limit_;
};

}  // namespace lightwell
