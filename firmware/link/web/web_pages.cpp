#include "link/web/web_pages.hpp"

#include <lightwell/secrets.hpp>

#include "link/web/metrics.hpp"
#include "link/web/web_request.hpp"

namespace lightwell {
namespace {

constexpr std::string_view kNoStore = "cache-control: no-store\r\n";
constexpr std::string_view kText = "text/plain; charset=utf-8";

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

WebPages::WebPages(std::span<const StaticFile> files, const Commands& commands) : commands_(commands) {
  for (const StaticFile& file : files)
    if (!content_type_of(file.path).empty())
      files_[std::string(file.path)] = {file.bytes, "\"" + to_hex(sha256(text_of(file.bytes))).substr(0, 16) + "\""};
}

WebPage WebPages::refusal(const WebRequest& request, int status, std::string_view text) {
  const std::string_view extra = status == 401   ? "www-authenticate: Bearer\r\n"
                                 : status == 405 ? "allow: GET, HEAD\r\n"
                                                 : "";
  return {response(request.method, status, kText, std::string(text) + "\n", std::string(kNoStore).append(extra)),
          {},
          status,
          {}};
}

WebPage WebPages::picture(WebMethod method, const PreviewJpeg& jpeg) {
  WebPage out{response_head(200, "image/jpeg", jpeg->size(), kNoStore), {}, 200, jpeg};
  if (method == WebMethod::get) out.file = *jpeg;
  return out;
}

WebPage WebPages::answer(const WebRequest& request) const {
  if (request.method == WebMethod::other) return refusal(request, 405, "only GET and HEAD are supported");
  if (!request.has_query && request.path == "/healthz")
    return {response(request.method, 200, "application/json", "{\"lightwell\":\"v1\",\"status\":\"ok\"}\n", kNoStore)};
  if (!request.has_query && request.path == "/metrics")
    return {response(request.method, 200, kMetricsContentType, metrics_text(commands_.status()), kNoStore)};
  const auto found =
      files_.find(request.path == "/" ? std::string_view("/index.html") : std::string_view(request.path));
  if (request.has_query || found == files_.end())
    return refusal(request, 404, "there is no such page here; see firmware/link/web/README.md of Lightwell");
  const auto& [path, file] = *found;
  const bool current = request.if_none_match == file.etag;
  WebPage out{response_head(current ? 304 : 200, content_type_of(path), file.bytes.size(),
                            "etag: " + file.etag + "\r\ncache-control: no-cache\r\n"),
              {},
              current ? 304 : 200,
              {}};
  if (!current && request.method == WebMethod::get) out.file = file.bytes;
  return out;
}

}  // namespace lightwell
