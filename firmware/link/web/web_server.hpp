// The web link's server on libwebsockets: its thread, connections, and what they exchange.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <libwebsockets.h>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <vector>

#include <lightwell/deleter.hpp>

#include "link/access/listen_address.hpp"
#include "link/access/server_tls.hpp"
#include "link/link.hpp"
#include "link/token_bucket.hpp"
#include "link/web/web_authorizer.hpp"
#include "link/web/web_pages.hpp"
#include "link/web/web_session.hpp"

namespace lightwell {

/// Opened once. The thread runs from open() to stop(); other methods may be called from any thread in between.
class WebServer {
 public:
  /// `commands` outlives the server. `tls` is null in plain text.
  WebServer(WebPages pages, WebAuthorizer authorizer, std::unique_ptr<ServerTls> tls, Commands& commands)
      : pages_(std::move(pages)), authorizer_(std::move(authorizer)), tls_(std::move(tls)), commands_(commands) {}
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer() { stop(); }

  /// Listens and starts the thread; false if the address cannot be used.
  [[nodiscard]] bool open(const ListenTarget& target);
  [[nodiscard]] int port() const { return port_; }
  void publish(const EncodedDescriptor& descriptor);
  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane);
  /// Closes all connections; takes at most about 300 ms.
  void stop();

  /// Without the failures of authentication.
  [[nodiscard]] LinkCounters counters() const {
    return {.clients = clients_.load(), .coalesced = coalesced_.load(), .messages_refused = refused_.load()};
  }

 private:
  /// A request for the preview, until the picture is there.
  struct PreviewRequest {
    WebRequest request;
    std::int64_t asked_ns = 0;
  };
  /// One TCP connection. Valid until libwebsockets destroys its socket.
  struct Connection {
    std::int64_t opened_ns = 0;  ///< Of the TCP connection, then of the WebSocket.
    // Decided by the request of a WebSocket's handshake.
    WebStream stream = WebStream::descriptors;
    WebAdmission admission = WebAdmission::pending;
    std::unique_ptr<WebSession> session;
    std::optional<WebClose> close;          ///< To be sent, then the connection ends.
    std::optional<PreviewRequest> preview;  ///< A request that waits for the picture.
    std::span<const std::byte> body{};      ///< Of an HTTP response, as far as it is not written.
    std::shared_ptr<const void> body_owner{};
    [[nodiscard]] bool accepted() const { return session && session->accepted(); }
  };
  struct Tick {
    lws_sorted_usec_list_t list{};
    WebServer* server = nullptr;
  };

  static int on_callback(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length);

  // Called by the thread, but for open().
  int handle(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length);
  int on_request(lws* wsi, Connection& connection);
  int on_upgrade(lws* wsi, Connection& connection, std::string_view protocol);
  int on_received(lws* wsi, Connection& connection, const WebFragment& fragment);
  int on_writable(lws* wsi, Connection& connection);
  int on_body_writable(lws* wsi, Connection& connection);
  int on_preview_request(lws* wsi, Connection& connection, const WebRequest& request);
  int on_preview_writable(lws* wsi, Connection& connection);
  void on_preview_poll();
  void schedule_preview_poll();
  void on_established(lws* wsi, Connection& connection);
  void on_tick();
  void schedule_tick(std::int64_t after_ns);
  void distribute();
  void close(lws* wsi, Connection& connection, const WebClose& why);
  void accept(lws* wsi, Connection& connection);
  void count_clients();

  /// Writes what it can of a response, and counts a refusal. 1 if the connection has ended, 0 if the rest follows.
  int write(lws* wsi, Connection& connection, WebPage page);
  [[nodiscard]] WebDecision check(lws* wsi, const WebRequest& request, LateToken late_token);

  const WebPages pages_;
  WebAuthorizer authorizer_;  ///< Of the thread, as all members from connections_ to stop_by_ns_.
  const std::unique_ptr<ServerTls> tls_;
  Commands& commands_;
  std::unique_ptr<lws_context, Deleter<lws_context_destroy>> context_;
  int port_ = 0;

  std::unordered_map<lws*, std::unique_ptr<Connection>> connections_;
  EncodedDescriptor newest_;
  std::shared_ptr<const EncodedPlane> newest_plane_;
  std::vector<unsigned char> send_buffer_;
  Tick tick_, preview_poll_;
  bool polling_preview_ = false;
  TokenBucket preview_limit_{20, 20};
  std::int64_t stop_by_ns_ = 0;  ///< 0: not stopping.

  std::mutex mutex_;
  EncodedDescriptor published_;
  std::vector<std::shared_ptr<const EncodedPlane>> published_planes_;

  std::atomic<std::uint32_t> clients_{0};  ///< Of descriptors.
  std::atomic<std::uint64_t> coalesced_{0}, refused_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace lightwell
