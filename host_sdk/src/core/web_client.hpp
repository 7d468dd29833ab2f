// WebSockets of a client, on libwebsockets.
#pragma once

#include <cstddef>
#include <libwebsockets.h>
#include <list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <lightwell/client_tls.hpp>
#include <lightwell/deleter.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// What one WebSocket calls, from WebClient::open() and run_once().
class WebHandler {
 public:
  virtual ~WebHandler() = default;

  /// The handshake is complete.
  virtual void on_open() = 0;
  virtual void on_message(std::span<const std::byte> bytes) = 0;
  /// A message above WebClientOptions::max_message_bytes was dropped; `bytes`: as far as it was received.
  virtual void on_oversized(std::size_t bytes) = 0;
  /// The connection could not be made, or has ended.
  virtual void on_closed(const std::string& why) = 0;
  /// Writes the next message to be sent into `out`; false if there is none. Called after WebClient::write_soon().
  [[nodiscard]] virtual bool next_message(std::vector<std::byte>& out) = 0;
};

struct WebClientOptions {
  std::string host_port;  ///< As the user wrote it, for the header Host.
  std::string address;    ///< Numeric.
  int port = 0;
  ClientTls* tls = nullptr;  ///< Null: plain text. Outlives the client.
  std::string token;         ///< Sent over TLS, after the check of the server's certificate.
  std::size_t max_message_bytes = 0;
  int connect_timeout_s = 2;
};

/// The WebSockets of one connection to a probe. All calls but wake() from one thread, in which SIGPIPE should be
/// blocked: OpenSSL writes to sockets whose other end may be closed.
class WebClient {
 public:
  explicit WebClient(WebClientOptions options);
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;
  /// Closes all WebSockets, without events.
  ~WebClient();

  /// Starts to connect; the result is an event of `handler`, which lives as long as run_once() is called. False if
  /// there is no memory.
  [[nodiscard]] bool open(const char* path, WebHandler& handler);
  /// Lets next_message() of the handler be called.
  void write_soon(const WebHandler& handler);
  /// Waits for events until wake() or at most `wait`, and calls the handlers.
  void run_once(Duration wait);
  /// Any thread.
  void wake();

 private:
  struct Socket {
    WebHandler* handler = nullptr;
    lws* wsi = nullptr;  ///< Null before the connection and after its end.
    std::vector<std::byte> message{};
    std::size_t received_bytes = 0;  ///< Of the message so far, also if it is too large.
    std::string close_reason{};
  };

  static int on_callback(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length);
  int handle(Socket& socket, lws* wsi, lws_callback_reasons reason, void* in, std::size_t length);
  int add_token(lws* wsi, void* in, std::size_t length) const;
  void on_fragment(Socket& socket, lws* wsi, std::span<const std::byte> bytes);
  int send_next(Socket& socket, lws* wsi);
  void end(Socket& socket, const std::string& why);

  const WebClientOptions options_;
  std::list<Socket> sockets_;  ///< libwebsockets keeps pointers to the elements.
  std::vector<std::byte> outgoing_;
  std::vector<unsigned char> send_buffer_;
  lws_sorted_usec_list_t timer_{};
  std::unique_ptr<lws_context, Deleter<lws_context_destroy>> context_;
};

}  // namespace lightwell::core
