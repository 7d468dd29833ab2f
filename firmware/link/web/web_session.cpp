#include "link/web/web_session.hpp"

#include <utility>

namespace lightwell {
namespace {

// RFC 6455, section 7.4.1.
constexpr std::uint16_t kUnsupportedData = 1003, kInvalidData = 1007, kPolicyViolation = 1008, kTooLarge = 1009;

}  // namespace

std::optional<WebClose> WebSession::refuse(std::uint16_t code, std::string_view reason) {
  ++refused_;
  return WebClose{code, reason};
}

std::optional<WebClose> WebSession::receive(const WebFragment& fragment, std::int64_t now_ns) {
  if (fragment.is_text) return refuse(kUnsupportedData, "messages must be binary");
  if (fragment.bytes.size() > kMaxWebRequestBytes - request_.size())
    return refuse(kTooLarge, "a request has at most 4096 bytes");
  if (++fragments_ > kMaxFragments) return refuse(kPolicyViolation, "a request has at most 64 fragments");
  request_.insert(request_.end(), fragment.bytes.begin(), fragment.bytes.end());
  if (!fragment.is_last) return std::nullopt;
  fragments_ = 0;
  const std::optional<WebClose> why = execute(now_ns);
  request_.clear();
  return why;
}

std::optional<WebClose> WebSession::execute(std::int64_t now_ns) {
  if (!requests_.take(now_ns)) return refuse(kPolicyViolation, "more than 50 requests a second");
  if (responses_.size() >= kMaxResponses) return refuse(kPolicyViolation, "requests do not wait for their responses");
  if (!accepted()) {
    const std::optional<AuthenticateRequest> request = decode_authenticate(request_);
    // The token is checked even if there is none, so that the failure is counted and takes the same time.
    const bool known = host_.accepts_token(request ? request->token : std::string());
    if (!known || !request) return WebClose{kPolicyViolation, kWebNotAuthenticated};
    admission_ = WebAdmission::accepted;
  }
  std::vector<std::byte> response;
  if (!answer_link_request(request_, host_.commands, response).ok())
    return refuse(kInvalidData, "not a LinkRequest of proto/lightwell/v1/link_message.proto");
  responses_.push_back(std::move(response));
  return std::nullopt;
}

bool WebSession::offer(const EncodedDescriptor& descriptor) {
  const bool replaced = descriptor_ != nullptr;
  descriptor_ = descriptor;
  return replaced;
}

std::span<const std::byte> WebSession::next() {
  if (!responses_.empty()) {
    sending_response_ = std::move(responses_.front());
    responses_.pop_front();
    return sending_response_;
  }
  if (descriptor_) {
    sending_descriptor_ = std::exchange(descriptor_, nullptr);
    return *sending_descriptor_;
  }
  sending_plane_ = planes_.take();
  return sending_plane_ ? std::span<const std::byte>(*sending_plane_) : std::span<const std::byte>();
}

}  // namespace lightwell
