// What the web link reads of an HTTP request, and how it writes a response, through libwebsockets.
#pragma once

#include <cstddef>
#include <libwebsockets.h>
#include <string>
#include <string_view>

#include "link/web/request_policy.hpp"

namespace lightwell {

[[nodiscard]] WebRequest read_request(lws* wsi);

/// Status line and headers of a response, to the empty line. Every response ends its connection. `extra`: further
/// header lines, each with its line end.
[[nodiscard]] std::string response_head(int status, std::string_view content_type, std::size_t content_length,
                                        std::string_view extra = {});
/// A whole response: `body` follows the head, except for HEAD. `extra`: as that of response_head().
[[nodiscard]] std::string response(WebMethod method, int status, std::string_view content_type, std::string_view body,
                                   std::string_view extra = {});
/// The client's address in numbers.
[[nodiscard]] std::string peer_of(lws* wsi);
/// Writes bytes of a response. False if the connection is lost.
[[nodiscard]] bool write_http(lws* wsi, std::string_view bytes);

}  // namespace lightwell
