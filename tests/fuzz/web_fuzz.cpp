// A WebSession on any fragments, and the decisions on any headers: nothing is sent before the authentication, every
// accepted request has a response, memory is limited, and a host that is trusted is no name of public DNS.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/link_message.hpp>

#include "link/web/request_policy.hpp"
#include "link/web/web_session.hpp"
#include "support/fake_commands.hpp"

namespace {

using namespace lightwell;

void require(bool holds) {
  if (!holds) std::abort();
}

void check_session(std::span<const std::byte> rest, WebAdmission admission) {
  test::FakeCommands commands;
  WebSession session(WebStream::descriptors, admission,
                     {commands, [](const std::string& token) { return token == "right"; }});
  std::size_t responses = 0, completed = 0;
  std::int64_t now_ns = 1;
  while (rest.size() >= 2) {
    const auto order = std::to_integer<unsigned>(rest[0]);
    const std::size_t size = std::min<std::size_t>(rest.size() - 2, std::to_integer<unsigned>(rest[1]) * 20U);
    const std::span<const std::byte> bytes = rest.subspan(2, size);
    rest = rest.subspan(2 + size);
    now_ns += order * 1'000'000;
    const bool is_last = (order & 1U) != 0;
    const bool was_accepted = session.accepted();
    const auto close = session.receive({bytes, (order & 0xe0U) == 0xe0U, is_last}, now_ns);
    if (close) {
      require(close->code >= 1000 && close->code < 1016 && close->reason.size() <= 123);
      return;
    }
    if (is_last) {
      ++completed;
      require(session.accepted());
    }
    require(is_last || session.accepted() == was_accepted);
    if ((order & 2U) != 0) {
      const std::span<const std::byte> response = session.next();
      if (!response.empty()) {
        require(decode_link_response(response).ok());
        ++responses;
      }
    }
    require(completed - responses <= WebSession::kMaxResponses);
  }
  while (session.has_next()) {
    require(decode_link_response(session.next()).ok());
    ++responses;
  }
  require(responses == completed);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span all = std::as_bytes(std::span(data, size));
  check_session(all, WebAdmission::accepted);
  check_session(all, WebAdmission::pending);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t middle = std::min(text.find('\n'), text.size());
  const std::string_view origin = text.substr(0, middle), host = text.substr(std::min(middle + 1, text.size()));
  const std::vector<std::string> allowed = {"https://viewer.example"};
  if (is_origin_allowed(origin, host, allowed))
    require(origin.empty() || origin.size() == host.size() + (origin.starts_with("https") ? 8 : 7) ||
            origin.size() == allowed.front().size());
  if (is_host_trusted(host, {})) require(!host.ends_with(".example"));
  (void)content_type_of(text);
  return 0;
}
