#include "core/web_client.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <lightwell/pipe_signal.hpp>
#include <lightwell/text.hpp>

namespace lightwell::core {
namespace {

constexpr const char* kSubprotocol = "lightwell.v1";

/// Why a handshake failed: `status` is that of the HTTP response, 0 without one; `error` is libwebsockets' text.
std::string explained(unsigned status, std::string_view error) {
  switch (status) {
    case 401:
      return "the probe does not accept this client's token or certificate: pair with it again (`lightwelld --pair` "
             "there, "
             "`lightwell pair` here)";
    case 429:
      return "the probe refused this client's token or certificate too often, and now waits: pair with it again "
             "(`lightwelld --pair` there, `lightwell pair` here)";
    case 0:
    case 101:
      return error.empty() ? "the connection failed" : printable(error);
    default:
      return "the server is no web link of a probe, or does not admit this client: HTTP status " +
             std::to_string(status);
  }
}

}  // namespace

WebClient::WebClient(WebClientOptions options) : options_(std::move(options)) {
  static const lws_protocols kProtocols[] = {{kSubprotocol, &WebClient::on_callback, 0, 4096, 0, nullptr, 0},
                                             {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  // Ping after 10 s without a sign of life, end after 20 s; the SDK's silence limit is usually shorter.
  static const lws_retry_bo_t kIdle = {nullptr, 0, 0, 10, 20, 0};
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = kProtocols;
  info.user = this;
  info.retry_and_idle_policy = &kIdle;
  info.fd_limit_per_thread = 16;
  // A probe is on the local network: the empty address keeps libwebsockets from the proxy of the environment variables.
  info.http_proxy_address = "";
  info.timeout_secs = info.connect_timeout_secs = static_cast<unsigned>(options_.connect_timeout_s);
  info.options = LWS_SERVER_OPTION_DISABLE_OS_CA_CERTS;
  if (options_.tls != nullptr) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    info.provided_client_ssl_ctx = options_.tls->context();
    info.alpn = "http/1.1";
  }
  // libwebsockets sets SIGPIPE to be ignored for the whole process.
  keep_pipe_signal([&] { context_.reset(lws_create_context(&info)); });
}

WebClient::~WebClient() {
  // Destroying the context has events.
  for (Socket& socket : sockets_) socket.handler = nullptr;
  context_.reset();
}

bool WebClient::open(const char* path, WebHandler& handler) {
  if (!context_) return false;
  Socket& socket = sockets_.emplace_back();
  socket.handler = &handler;
  lws_client_connect_info info{};
  info.context = context_.get();
  info.address = options_.address.c_str();
  info.port = options_.port;
  info.path = path;
  info.host = options_.host_port.c_str();
  info.protocol = kSubprotocol;
  info.local_protocol_name = kSubprotocol;
  info.opaque_user_data = &socket;
  info.pwsi = &socket.wsi;
  // ClientTls checks the name.
  if (options_.tls != nullptr) info.ssl_connection = LCCSCF_USE_SSL | LCCSCF_SKIP_SERVER_CERT_HOSTNAME_CHECK;
  // A failure is also an event, which may have come already.
  (void)lws_client_connect_via_info(&info);
  return true;
}

void WebClient::write_soon(const WebHandler& handler) {
  for (const Socket& socket : sockets_)
    if (socket.handler == &handler && socket.wsi != nullptr) lws_callback_on_writable(socket.wsi);
}

void WebClient::run_once(Duration wait) {
  lws_sul_schedule(
      context_.get(), 0, &timer_, [](lws_sorted_usec_list_t*) {}, std::max<std::int64_t>(wait.ns / 1000, 1));
  lws_service(context_.get(), 0);
}

void WebClient::wake() { lws_cancel_service(context_.get()); }

int WebClient::on_callback(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in, std::size_t length) {
  lws_context* const context = lws_get_context(wsi);
  auto* const self = context == nullptr ? nullptr : static_cast<WebClient*>(lws_context_user(context));
  switch (reason) {
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
    case LWS_CALLBACK_CLIENT_RECEIVE:
    case LWS_CALLBACK_CLIENT_WRITEABLE:
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLIENT_CLOSED:
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
      break;
    default:
      return 0;
  }
  auto* const socket = static_cast<Socket*>(lws_get_opaque_user_data(wsi));
  return self == nullptr || socket == nullptr || socket->handler == nullptr
             ? 0
             : self->handle(*socket, wsi, reason, in, length);
}

int WebClient::handle(Socket& socket, lws* wsi, lws_callback_reasons reason, void* in, std::size_t length) {
  switch (reason) {
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
      return add_token(wsi, in, length);
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      socket.wsi = wsi;
      socket.handler->on_open();
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
      on_fragment(socket, wsi, {static_cast<const std::byte*>(in), length});
      return 0;
    case LWS_CALLBACK_CLIENT_WRITEABLE:
      return send_next(socket, wsi);
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
      if (length > 2) socket.close_reason = printable({static_cast<const char*>(in) + 2, length - 2});
      return 0;
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR: {
      const std::string rejected = options_.tls == nullptr ? std::string() : options_.tls->rejection();
      const std::string_view error = in == nullptr ? std::string_view() : static_cast<const char*>(in);
      end(socket, rejected.empty() ? explained(lws_http_client_http_response(wsi), error)
                                   : "the TLS handshake failed: " + rejected +
                                         "; if the probe was given new keys, pair with it again");
      return 0;
    }
    case LWS_CALLBACK_CLIENT_CLOSED:
      end(socket,
          socket.close_reason.empty() ? "the connection was lost" : "the probe ended it: " + socket.close_reason);
      return 0;
    default:
      return 0;
  }
}

int WebClient::add_token(lws* wsi, void* in, std::size_t length) const {
  if (options_.tls == nullptr || options_.token.empty()) return 0;
  auto** const position = static_cast<unsigned char**>(in);
  const std::string value = "Bearer " + options_.token;
  return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>("authorization:"),
                                     reinterpret_cast<const unsigned char*>(value.data()),
                                     static_cast<int>(value.size()), position, *position + length);
}

void WebClient::on_fragment(Socket& socket, lws* wsi, std::span<const std::byte> bytes) {
  if (lws_is_first_fragment(wsi) != 0) {
    socket.message.clear();
    socket.received_bytes = 0;
  }
  socket.received_bytes += bytes.size();
  if (socket.received_bytes <= options_.max_message_bytes)
    socket.message.insert(socket.message.end(), bytes.begin(), bytes.end());
  if (lws_is_final_fragment(wsi) == 0) return;
  if (socket.received_bytes > options_.max_message_bytes)
    socket.handler->on_oversized(socket.received_bytes);
  else
    socket.handler->on_message(socket.message);
}

int WebClient::send_next(Socket& socket, lws* wsi) {
  if (!socket.handler->next_message(outgoing_)) return 0;
  send_buffer_.resize(LWS_PRE + outgoing_.size());
  std::memcpy(send_buffer_.data() + LWS_PRE, outgoing_.data(), outgoing_.size());
  if (lws_write(wsi, send_buffer_.data() + LWS_PRE, outgoing_.size(), LWS_WRITE_BINARY) < 0) return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

void WebClient::end(Socket& socket, const std::string& why) {
  socket.wsi = nullptr;
  socket.handler->on_closed(why);
}

}  // namespace lightwell::core
