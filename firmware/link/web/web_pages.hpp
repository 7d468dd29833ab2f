// The pages that the web link serves by HTTP: the dashboard's files, health and metrics.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/commands.hpp>

#include "link/web/request_policy.hpp"
#include "link/web/static_file.hpp"

namespace lightwell {

/// A response: `head_and_text` first, then `file`, which `owner` keeps if it is not part of the program.
struct WebPage {
  std::string head_and_text;
  std::span<const std::byte> file{};
  int status = 200;
  std::shared_ptr<const void> owner{};
};

/// The address of the camera's preview, which WebServer answers with the pages below.
inline constexpr std::string_view kPreviewPath = "/v1/preview.jpg";

/// One thread.
class WebPages {
 public:
  /// `files` and `commands` outlive the object. Files of unknown types are left out.
  WebPages(std::span<const StaticFile> files, const Commands& commands);

  /// Whether the page is only for authenticated clients.
  [[nodiscard]] static bool needs_authentication(const WebRequest& request) {
    return request.path == "/metrics" || is_preview(request);
  }
  [[nodiscard]] static bool is_preview(const WebRequest& request) {
    return request.path == kPreviewPath && !request.has_query && request.method != WebMethod::other;
  }
  /// The response to a request that is authenticated, if that is needed.
  [[nodiscard]] WebPage answer(const WebRequest& request) const;
  /// The response with a picture; `jpeg` is not null.
  [[nodiscard]] static WebPage picture(WebMethod method, const PreviewJpeg& jpeg);
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
