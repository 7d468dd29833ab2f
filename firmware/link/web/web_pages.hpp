// The pages that the web link serves by HTTP: the dashboard's files, health and metrics.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/commands.hpp>

#include "link/web/request_policy.hpp"
#include "link/web/static_file.hpp"

namespace lightwell {

/// A response: `head_and_text` first, then `file`.
struct WebPage {
  std::string head_and_text;
  std::span<const std::byte> file{};
  int status = 200;
};

/// One thread.
class WebPages {
 public:
  /// `files` and `commands` outlive the object. Files of unknown types are left out.
  WebPages(std::span<const StaticFile> files, const Commands& commands);

  /// Whether the page is only for authenticated clients.
  [[nodiscard]] static bool needs_authentication(const WebRequest& request) { return request.path == "/metrics"; }
  /// The response to a request that is authenticated, if that is needed.
  [[nodiscard]] WebPage answer(const WebRequest& request) const;
  /// The response to a request that is refused, with a text for people.
  [[nodiscard]] static WebPage refusal(const WebRequest& request, int status, std::string_view text);

 private:
  struct File {
    std::span<const std::byte> bytes;
    std::string etag;
  };

  std::map<std::string, File, std::less<>> files_;
  const Commands& commands_;
};

}  // namespace lightwell
