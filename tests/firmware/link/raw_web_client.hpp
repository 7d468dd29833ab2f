// A client of the web link that writes and reads HTTP and WebSocket frames (RFC 6455) itself, over TCP or TLS.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "link/link.hpp"
#include "support/wait.hpp"

struct ssl_st;
struct ssl_ctx_st;

namespace lightwell::test {

/// Opcodes of RFC 6455, section 5.2.
enum class Opcode : std::uint8_t { continuation = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };
enum class Fin : bool { no, yes };

struct WebFrame {
  Opcode opcode = Opcode::binary;
  std::string payload;

  /// Of a close frame; 0 without a code.
  [[nodiscard]] int close_code() const;
};

struct HttpReply {
  int status = 0;  ///< 0: the connection ended without a response.
  std::string head, body;
};

/// TLS with the probe's authority as the only trusted one, and an optional client certificate (PEM).
struct RawTls {
  std::string trust;
  std::string certificate{}, key{};
};

class RawWebClient {
 public:
  /// Connects to 127.0.0.1:port, with a TLS handshake if `tls` is given.
  explicit RawWebClient(int port, const std::optional<RawTls>& tls = {});
  explicit RawWebClient(const Link& link, const std::optional<RawTls>& tls = {});
  RawWebClient(const RawWebClient&) = delete;
  RawWebClient& operator=(const RawWebClient&) = delete;
  ~RawWebClient();

  /// Lets the kernel keep little of what is not read.
  void shrink_receive_buffer() const;
  /// Whether TCP connection and TLS handshake succeeded.
  [[nodiscard]] bool connected() const { return connected_; }
  /// False if the other end has closed the connection.
  bool send(std::string_view bytes);
  /// At least one byte; empty if the connection has ended or the time is over.
  [[nodiscard]] std::string receive(std::chrono::milliseconds timeout = kTestTimeout);
  /// Whether the other end closes the connection, whatever it sends before.
  [[nodiscard]] bool is_closed_by_peer(std::chrono::milliseconds timeout = kTestTimeout);

  /// Sends a request and reads the response to its end. `head`: "GET / HTTP/1.1", then header lines, without the empty
  /// line; Host is added.
  [[nodiscard]] HttpReply request(const std::string& head);
  /// The WebSocket handshake; the status is 101 on success. `headers`: further header lines, each with its line end.
  [[nodiscard]] HttpReply upgrade(const std::string& path = "/v1/descriptors", const std::string& headers = {},
                                  const std::string& protocol = "lightwell.v1");

  /// Sends one masked frame.
  bool send_frame(std::string_view payload, Opcode opcode = Opcode::binary, Fin fin = Fin::yes);
  /// The next frame, pings included; no value if the connection has ended or the time is over.
  [[nodiscard]] std::optional<WebFrame> next_frame(std::chrono::milliseconds timeout = kTestTimeout);
  /// Payload of the next binary message; pings are answered. No value as next_frame(), and for a close frame.
  [[nodiscard]] std::optional<std::string> next(std::chrono::milliseconds timeout = kTestTimeout);
  /// The close frame that comes next, after any other frames; no value if the connection ends without one.
  [[nodiscard]] std::optional<WebFrame> close_frame();

 private:
  /// Reads until `received_` has `bytes` bytes.
  [[nodiscard]] bool fill(std::size_t bytes, std::chrono::steady_clock::time_point end);

  int socket_ = -1;
  bool connected_ = false, ended_ = false;
  std::string host_;
  ssl_ctx_st* context_ = nullptr;
  ssl_st* tls_ = nullptr;
  std::string received_;
};

/// Bytes of a masked frame, as a client sends it.
[[nodiscard]] std::string frame_bytes(std::string_view payload, Opcode opcode = Opcode::binary, Fin fin = Fin::yes);

[[nodiscard]] int port_of(const Link& link);

}  // namespace lightwell::test
