#include "link/web/web_request.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace lightwell {
namespace {

constexpr std::size_t kMaxHeaderBytes = 512;

std::string header_of(lws* wsi, lws_token_indexes token) {
  const int length = lws_hdr_total_length(wsi, token);
  if (length <= 0 || static_cast<std::size_t>(length) > kMaxHeaderBytes) return {};
  std::string out(static_cast<std::size_t>(length) + 1, '\0');
  const int copied = lws_hdr_copy(wsi, out.data(), static_cast<int>(out.size()), token);
  out.resize(copied > 0 ? static_cast<std::size_t>(copied) : 0);
  return out;
}

std::string_view phrase_of(int status) {
  static constexpr std::pair<int, std::string_view> kPhrases[] = {{200, "OK"},
                                                                  {304, "Not Modified"},
                                                                  {400, "Bad Request"},
                                                                  {401, "Unauthorized"},
                                                                  {403, "Forbidden"},
                                                                  {404, "Not Found"},
                                                                  {405, "Method Not Allowed"},
                                                                  {429, "Too Many Requests"},
                                                                  {503, "Service Unavailable"}};
  for (const auto& [number, phrase] : kPhrases)
    if (number == status) return phrase;
  return "Error";
}

/// Same origin only, and nothing inline.
constexpr std::string_view kSecurityHeaders =
    "x-content-type-options: nosniff\r\n"
    "referrer-policy: no-referrer\r\n"
    "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "font-src 'self'; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'\r\n";

}  // namespace

WebRequest read_request(lws* wsi) {
  WebRequest out;
  char* path = nullptr;
  int length = 0;
  const int method = lws_http_get_uri_and_method(wsi, &path, &length);
  if (method == LWSHUMETH_GET) out.method = WebMethod::get;
  if (method == LWSHUMETH_HEAD) out.method = WebMethod::head;
  if (path != nullptr && length > 0) out.path.assign(path, static_cast<std::size_t>(length));
  out.has_query = lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_URI_ARGS) > 0;
  out.host = header_of(wsi, WSI_TOKEN_HOST);
  out.origin = header_of(wsi, WSI_TOKEN_ORIGIN);
  out.authorization = header_of(wsi, WSI_TOKEN_HTTP_AUTHORIZATION);
  out.has_authorization = lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_AUTHORIZATION) > 0;
  out.protocols = header_of(wsi, WSI_TOKEN_PROTOCOL);
  out.if_none_match = header_of(wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH);
  return out;
}

std::string response_head(int status, std::string_view content_type, std::size_t content_length,
                          std::string_view extra) {
  std::string out = "HTTP/1.1 " + std::to_string(status) + " ";
  out += phrase_of(status);
  out += "\r\ncontent-type: ";
  out += content_type;
  out += "\r\ncontent-length: " + std::to_string(content_length) + "\r\nconnection: close\r\n";
  out += kSecurityHeaders;
  out += extra;
  return out + "\r\n";
}

std::string response(WebMethod method, int status, std::string_view content_type, std::string_view body,
                     std::string_view extra) {
  std::string out = response_head(status, content_type, body.size(), extra);
  if (method != WebMethod::head) out += body;
  return out;
}

std::string peer_of(lws* wsi) {
  char address[64] = {};
  lws_get_peer_simple(wsi, address, sizeof address);
  return address;
}

bool write_http(lws* wsi, std::string_view bytes) {
  // libwebsockets writes its frame header before the bytes on other protocols than HTTP/1.
  std::vector<unsigned char> buffer(LWS_PRE + bytes.size());
  std::copy(bytes.begin(), bytes.end(), buffer.begin() + LWS_PRE);
  return lws_write(wsi, buffer.data() + LWS_PRE, bytes.size(), LWS_WRITE_HTTP) >= static_cast<int>(bytes.size());
}

}  // namespace lightwell
