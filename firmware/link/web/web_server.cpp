#include "link/web/web_server.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <strings.h>
#include <utility>

#include <sys/socket.h>

#include <lightwell/time.hpp>

#include "link/web/web_request.hpp"

namespace lightwell {
namespace {

constexpr const char* kSubprotocol = "lightwell.v1";
constexpr std::int64_t kSecondNs = 1'000'000'000;

/// Connections, and those of them that are no accepted WebSocket.
constexpr std::size_t kMaxConnections = 128, kMaxUnaccepted = 32;
/// For the TLS handshake, for request line and headers, and for the first message of a client that is not
/// authenticated.
constexpr unsigned kHandshakeSeconds = 5;
/// Longest life of a connection that is no WebSocket.
constexpr std::int64_t kMaxHttpNs = 60 * kSecondNs;
constexpr std::uint16_t kMaxHeadBytes = 8 * 1024;
/// Bytes of a file that are written at once.
constexpr std::size_t kFileChunk = 16 * 1024;
/// The kernel's buffer for a client: a slow client receives the newest descriptor, not those of the last minutes.
constexpr int kSendBufferBytes = 16 * 1024;
constexpr std::int64_t kStopNs = 300'000'000;
/// How often a request that waits for the preview looks for it, and how long it waits.
constexpr std::int64_t kPreviewPollNs = 20'000'000, kMaxPreviewWaitNs = 3 * kSecondNs;

}  // namespace

bool WebServer::open(const ListenTarget& target) {
  static const lws_protocols kProtocols[] = {
      {"http", &WebServer::on_callback, 0, 0, 0, nullptr, 0},
      {kSubprotocol, &WebServer::on_callback, 0, kMaxWebRequestBytes, 0, nullptr, 0},
      {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  // Ping after 10 s without a sign of life, end after 20 s.
  static const lws_retry_bo_t kIdle = {nullptr, 0, 0, 10, 20, 0};
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = target.port;
  info.iface = target.address.empty() ? nullptr : target.address.c_str();
  info.protocols = kProtocols;
  info.user = this;
  info.retry_and_idle_policy = &kIdle;
  info.timeout_secs = info.timeout_secs_ah_idle = kHandshakeSeconds;
  info.max_http_header_data = kMaxHeadBytes;
  // Its own descriptors, and one connection more than allowed, which is closed when it is accepted.
  info.fd_limit_per_thread = kMaxConnections + 8;
  info.max_http_header_pool = static_cast<std::uint16_t>(kMaxConnections + 8);
  info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  if (!target.ipv6) info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  if (tls_) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT | LWS_SERVER_OPTION_CREATE_VHOST_SSL_CTX;
    info.alpn = "http/1.1";
  }
  context_.reset(lws_create_context(&info));
  lws_vhost* const host = context_ ? lws_get_vhost_by_name(context_.get(), "default") : nullptr;
  if (host == nullptr) {
    context_.reset();
    return false;
  }
  port_ = lws_get_vhost_listen_port(host);
  thread_ = std::thread([this] {
    tick_.server = preview_poll_.server = this;
    schedule_tick(kSecondNs);
    while (stop_by_ns_ == 0 || (!connections_.empty() && monotonic_now_ns() < stop_by_ns_))
      if (lws_service(context_.get(), 0) < 0) break;
  });
  return true;
}

void WebServer::publish(const EncodedDescriptor& descriptor) {
  {
    const std::lock_guard lock(mutex_);
    if (published_) coalesced_ += clients_.load();
    published_ = descriptor;
  }
  lws_cancel_service(context_.get());
}

void WebServer::publish_plane(const std::shared_ptr<const EncodedPlane>& plane) {
  {
    const std::lock_guard lock(mutex_);
    // Of several, the last two are enough to show sessions a gap.
    if (published_planes_.size() == 2) published_planes_.erase(published_planes_.begin());
    published_planes_.push_back(plane);
  }
  lws_cancel_service(context_.get());
}

void WebServer::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  lws_cancel_service(context_.get());
  thread_.join();
  context_.reset();
  connections_.clear();
  count_clients();
}

int WebServer::on_callback(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
  lws_context* const context = lws_get_context(wsi);
  auto* const self = context == nullptr ? nullptr : static_cast<WebServer*>(lws_context_user(context));
  return self == nullptr ? 0 : self->handle(wsi, reason, user, in, length);
}

int WebServer::handle(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
  const auto found = connections_.find(wsi);
  Connection* const connection = found == connections_.end() ? nullptr : found->second.get();
  switch (reason) {
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS:
      return tls_->configure(static_cast<ssl_ctx_st*>(user)) ? 0 : -1;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      distribute();
      return 0;
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION: {
      const auto accepted = static_cast<std::size_t>(
          std::ranges::count_if(connections_, [](const auto& entry) { return entry.second->accepted(); }));
      if (connections_.size() < kMaxConnections && connections_.size() - accepted < kMaxUnaccepted && stop_by_ns_ == 0)
        return 0;
      ++refused_;
      return -1;
    }
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED: {
      auto made = std::make_unique<Connection>();
      made->opened_ns = monotonic_now_ns();
      connections_[wsi] = std::move(made);
      return 0;
    }
    case LWS_CALLBACK_WSI_DESTROY:
      connections_.erase(wsi);
      count_clients();
      return 0;
    case LWS_CALLBACK_HTTP:
      return connection == nullptr ? -1 : on_request(wsi, *connection);
    case LWS_CALLBACK_HTTP_WRITEABLE:
      if (connection == nullptr) return -1;
      return connection->preview ? on_preview_writable(wsi, *connection) : on_body_writable(wsi, *connection);
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return connection == nullptr ? -1 : on_upgrade(wsi, *connection, static_cast<const char*>(in));
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      // A client may have offered the name of the other protocol, too.
      return std::string_view(lws_get_protocol(wsi)->name) == kSubprotocol ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED:
      if (connection == nullptr) return -1;
      on_established(wsi, *connection);
      return 0;
    case LWS_CALLBACK_RECEIVE:
      if (connection == nullptr || !connection->session) return -1;
      return on_received(wsi, *connection,
                         {std::span(static_cast<const std::byte*>(in), length), lws_frame_is_binary(wsi) == 0,
                          lws_is_final_fragment(wsi) != 0});
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return connection == nullptr || !connection->session ? -1 : on_writable(wsi, *connection);
    // CONNECT, and bodies of requests.
    case LWS_CALLBACK_RAW_ADOPT:
    case LWS_CALLBACK_RAW_CONNECTED:
    case LWS_CALLBACK_RAW_RX:
    case LWS_CALLBACK_HTTP_BODY:
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return -1;
    default:
      return 0;
  }
}

WebDecision WebServer::check(lws* wsi, const WebRequest& request, LateToken late_token) {
  return authorizer_.check(request, peer_of(wsi),
                           tls_ ? ServerTls::client_certificate(lws_get_ssl(wsi)) : std::string(), late_token,
                           monotonic_now_ns());
}

int WebServer::write(lws* wsi, Connection& connection, WebPage page) {
  if (page.status >= 400 && page.status != 404) ++refused_;
  if (!write_http(wsi, page.head_and_text) || page.file.empty()) return 1;
  connection.body = page.file;
  connection.body_owner = std::move(page.owner);
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::on_request(lws* wsi, Connection& connection) {
  const WebRequest request = read_request(wsi);
  if (WebPages::needs_authentication(request))
    if (const WebDecision d = check(wsi, request, LateToken::refused); d.status != 200)
      return write(wsi, connection, WebPages::refusal(request, d.status, d.text));
  if (WebPages::is_preview(request)) return on_preview_request(wsi, connection, request);
  return write(wsi, connection, pages_.answer(request));
}

int WebServer::on_preview_request(lws* wsi, Connection& connection, const WebRequest& request) {
  const std::int64_t now = monotonic_now_ns();
  if (!preview_limit_.take(now))
    return write(
        wsi, connection,
        WebPages::refusal(request, 429, "too many requests for the preview; a new picture comes once a second"));
  connection.preview = PreviewRequest{request, now};
  return on_preview_writable(wsi, connection);
}

int WebServer::on_preview_writable(lws* wsi, Connection& connection) {
  const auto& [request, asked_ns] = *connection.preview;
  const Result<PreviewJpeg> jpeg = commands_.preview();
  WebPage page;
  if (!jpeg) {
    page = WebPages::refusal(request, jpeg.status().code() == StatusCode::failed_precondition ? 403 : 503,
                             jpeg.status().message());
  } else if (*jpeg) {
    page = WebPages::picture(request.method, *jpeg);
  } else if (monotonic_now_ns() - asked_ns > kMaxPreviewWaitNs) {
    page = WebPages::refusal(request, 503, "the camera has delivered no frame for three seconds; try again later");
  } else {
    if (!std::exchange(polling_preview_, true)) schedule_preview_poll();
    return 0;
  }
  connection.preview.reset();
  return write(wsi, connection, std::move(page));
}

void WebServer::on_preview_poll() {
  polling_preview_ = false;
  for (const auto& [wsi, connection] : connections_)
    if (connection->preview) lws_callback_on_writable(wsi);
}

int WebServer::on_body_writable(lws* wsi, Connection& connection) {
  const std::span<const std::byte> chunk = connection.body.first(std::min(connection.body.size(), kFileChunk));
  if (chunk.empty() || !write_http(wsi, {reinterpret_cast<const char*>(chunk.data()), chunk.size()})) return -1;
  connection.body = connection.body.subspan(chunk.size());
  if (connection.body.empty()) return -1;  // All is written; what is still buffered is sent before the end.
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, static_cast<int>(kHandshakeSeconds) * 2);
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::on_upgrade(lws* wsi, Connection& connection, std::string_view protocol) {
  const WebRequest request = read_request(wsi);
  const auto refuse = [&](int status, std::string_view text) {
    return write(wsi, connection, WebPages::refusal(request, status, text));
  };
  if (request.method != WebMethod::get || protocol.size() != 9 || strncasecmp(protocol.data(), "websocket", 9) != 0)
    return refuse(400, "the only upgrade is that of a GET request to websocket");
  if (request.has_query || (request.path != "/v1/descriptors" && request.path != "/v1/planes"))
    return refuse(404, "WebSockets are at /v1/descriptors and /v1/planes");
  if (request.protocols.find(kSubprotocol) == std::string::npos)
    return refuse(400, "sec-websocket-protocol must be lightwell.v1");
  const WebDecision decision = check(wsi, request, LateToken::allowed);
  if (decision.status != 200) return refuse(decision.status, decision.text);
  connection.stream = request.path == "/v1/planes" ? WebStream::planes : WebStream::descriptors;
  connection.admission = decision.admission;
  return 0;
}

void WebServer::on_established(lws* wsi, Connection& connection) {
  setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  connection.opened_ns = monotonic_now_ns();
  connection.session =
      std::make_unique<WebSession>(connection.stream, connection.admission,
                                   WebSessionHost{commands_, [this, peer = peer_of(wsi)](const std::string& token) {
                                                    return authorizer_.accepts_token(peer, token, monotonic_now_ns());
                                                  }});
  if (connection.accepted()) accept(wsi, connection);
}

void WebServer::accept(lws* wsi, Connection& connection) {
  count_clients();
  if (connection.stream == WebStream::descriptors && newest_) connection.session->offer(newest_);
  if (connection.stream == WebStream::planes && newest_plane_) connection.session->offer(newest_plane_);
  if (connection.session->has_next()) lws_callback_on_writable(wsi);
}

int WebServer::on_received(lws* wsi, Connection& connection, const WebFragment& fragment) {
  if (connection.close) return 0;
  WebSession& session = *connection.session;
  const bool was_accepted = session.accepted();
  const std::uint64_t refused = session.refused();
  const std::optional<WebClose> why = session.receive(fragment, monotonic_now_ns());
  refused_ += session.refused() - refused;
  if (why) {
    close(wsi, connection, *why);
    return 0;
  }
  if (session.accepted() != was_accepted) accept(wsi, connection);
  if (!session.wants_input()) lws_rx_flow_control(wsi, 0);
  if (session.has_next()) lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::on_writable(lws* wsi, Connection& connection) {
  if (connection.close) {
    std::string reason(connection.close->reason);
    lws_close_reason(wsi, static_cast<lws_close_status>(connection.close->code),
                     reinterpret_cast<unsigned char*>(reason.data()), reason.size());
    return -1;
  }
  const std::span<const std::byte> message = connection.session->next();
  if (message.empty()) return 0;
  send_buffer_.resize(std::max(send_buffer_.size(), LWS_PRE + message.size()));
  std::memcpy(send_buffer_.data() + LWS_PRE, message.data(), message.size());
  if (lws_write(wsi, send_buffer_.data() + LWS_PRE, message.size(), LWS_WRITE_BINARY) < 0) return -1;
  if (connection.session->wants_input()) lws_rx_flow_control(wsi, 1);
  if (connection.session->has_next()) lws_callback_on_writable(wsi);
  return 0;
}

void WebServer::close(lws* wsi, Connection& connection, const WebClose& why) {
  if (connection.close) return;
  connection.close = why;
  lws_callback_on_writable(wsi);
  // If the client does not read.
  lws_set_timeout(wsi, PENDING_TIMEOUT_USER_REASON_BASE, 3);
}

void WebServer::distribute() {
  EncodedDescriptor descriptor;
  std::vector<std::shared_ptr<const EncodedPlane>> planes;
  {
    const std::lock_guard lock(mutex_);
    descriptor.swap(published_);
    planes.swap(published_planes_);
  }
  if (descriptor) newest_ = descriptor;
  if (!planes.empty()) newest_plane_ = planes.back();
  for (const auto& [wsi, connection] : connections_) {
    if (stopping_ && connection->session) close(wsi, *connection, {1001, "the probe is shutting down"});
    if (!connection->accepted() || connection->close) continue;
    if (descriptor && connection->stream == WebStream::descriptors && connection->session->offer(descriptor))
      ++coalesced_;
    if (connection->stream == WebStream::planes)
      for (const auto& plane : planes) connection->session->offer(plane);
    if (connection->session->has_next()) lws_callback_on_writable(wsi);
  }
  if (stopping_ && stop_by_ns_ == 0) {
    stop_by_ns_ = monotonic_now_ns() + kStopNs;
    schedule_tick(kStopNs / 6);
  }
}

void WebServer::on_tick() {
  const std::int64_t now = monotonic_now_ns();
  for (const auto& [wsi, connection] : connections_) {
    const std::int64_t age = now - connection->opened_ns;
    if (!connection->session && age > kMaxHttpNs)
      lws_set_timeout(wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_ASYNC);
    if (connection->session && !connection->accepted() && !connection->close && age > kHandshakeSeconds * kSecondNs) {
      (void)authorizer_.accepts_token(peer_of(wsi), {}, now);  // Counts it.
      close(wsi, *connection, {1008, kWebNotAuthenticated});
    }
  }
  schedule_tick(stop_by_ns_ == 0 ? kSecondNs : kStopNs / 6);
}

void WebServer::schedule_tick(std::int64_t after_ns) {
  lws_sul_schedule(
      context_.get(), 0, &tick_.list,
      [](lws_sorted_usec_list_t* list) { lws_container_of(list, Tick, list)->server->on_tick(); }, after_ns / 1000);
}

void WebServer::schedule_preview_poll() {
  lws_sul_schedule(
      context_.get(), 0, &preview_poll_.list,
      [](lws_sorted_usec_list_t* list) { lws_container_of(list, Tick, list)->server->on_preview_poll(); },
      kPreviewPollNs / 1000);
}

void WebServer::count_clients() {
  clients_ = static_cast<std::uint32_t>(std::ranges::count_if(connections_, [](const auto& entry) {
    return entry.second->accepted() && entry.second->stream == WebStream::descriptors;
  }));
}

}  // namespace lightwell
