#include "firmware/link/raw_web_client.hpp"

#include <cstring>
#include <poll.h>
#include <unistd.h>

#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include "support/loopback.hpp"

namespace lightwell::test {
namespace {

using Clock = std::chrono::steady_clock;

X509* certificate_of(const std::string& pem) {
  BIO* const text = BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  X509* const out = PEM_read_bio_X509(text, nullptr, nullptr, nullptr);
  BIO_free(text);
  return out;
}

ssl_ctx_st* context_of(const RawTls& tls) {
  SSL_CTX* const context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  if (X509* const trusted = certificate_of(tls.trust)) {
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context), trusted);
    X509_STORE_set_flags(SSL_CTX_get_cert_store(context), X509_V_FLAG_PARTIAL_CHAIN);
    X509_free(trusted);
  }
  if (tls.certificate.empty()) return context;
  X509* const own = certificate_of(tls.certificate);
  BIO* const text = BIO_new_mem_buf(tls.key.data(), static_cast<int>(tls.key.size()));
  EVP_PKEY* const key = PEM_read_bio_PrivateKey(text, nullptr, nullptr, nullptr);
  SSL_CTX_use_certificate(context, own);
  SSL_CTX_use_PrivateKey(context, key);
  EVP_PKEY_free(key);
  BIO_free(text);
  X509_free(own);
  return context;
}

}  // namespace

int port_of(const Link& link) {
  const std::string address = link.address();
  return std::stoi(address.substr(address.rfind(':') + 1));
}

int WebFrame::close_code() const {
  if (opcode != Opcode::close || payload.size() < 2) return 0;
  return static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1]);
}

RawWebClient::RawWebClient(const Link& link, const std::optional<RawTls>& tls) : RawWebClient(port_of(link), tls) {}

RawWebClient::RawWebClient(int port, const std::optional<RawTls>& tls)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), host_("127.0.0.1:" + std::to_string(port)) {
  const sockaddr_in to = loopback(port);
  connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (!connected_ || !tls) return;
  context_ = context_of(*tls);
  tls_ = SSL_new(context_);
  SSL_set_fd(tls_, socket_);
  connected_ = SSL_connect(tls_) == 1;
}

RawWebClient::~RawWebClient() {
  SSL_free(tls_);
  SSL_CTX_free(context_);
  ::close(socket_);
}

void RawWebClient::shrink_receive_buffer() const {
  constexpr int kBytes = 8 * 1024;
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kBytes, sizeof kBytes);
}

bool RawWebClient::send(std::string_view bytes) {
  if (tls_ != nullptr) return bytes.empty() || SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size())) > 0;
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

std::string RawWebClient::receive(std::chrono::milliseconds timeout) {
  if (ended_) return {};
  pollfd readable{socket_, POLLIN, 0};
  if ((tls_ == nullptr || SSL_pending(tls_) == 0) && ::poll(&readable, 1, static_cast<int>(timeout.count())) <= 0)
    return {};
  std::string out(64 * 1024, '\0');
  const auto got = tls_ == nullptr ? ::recv(socket_, out.data(), out.size(), 0)
                                   : SSL_read(tls_, out.data(), static_cast<int>(out.size()));
  ended_ = got <= 0;
  out.resize(ended_ ? 0 : static_cast<std::size_t>(got));
  return out;
}

bool RawWebClient::is_closed_by_peer(std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  while (!ended_ && Clock::now() < end)
    (void)receive(std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()));
  return ended_;
}

bool RawWebClient::fill(std::size_t bytes, Clock::time_point end) {
  while (received_.size() < bytes) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    const std::string more = left.count() <= 0 ? std::string() : receive(left);
    if (more.empty()) return false;
    received_ += more;
  }
  return true;
}

HttpReply RawWebClient::request(const std::string& head) {
  HttpReply out;
  if (!send(head + "\r\nHost: " + host_ + "\r\n\r\n")) return out;
  while (!ended_) {
    const std::string more = receive();
    if (more.empty()) break;
    received_ += more;
  }
  const std::size_t split = received_.find("\r\n\r\n");
  if (split == std::string::npos) return out;
  out.head = received_.substr(0, split + 2);
  out.body = received_.substr(split + 4);
  out.status = std::stoi(out.head.substr(out.head.find(' ') + 1));
  return out;
}

HttpReply RawWebClient::upgrade(const std::string& path, const std::string& headers, const std::string& protocol) {
  HttpReply out;
  std::string request = "GET " + path + " HTTP/1.1\r\nHost: " + host_ +
                        "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  if (!protocol.empty()) request += "Sec-WebSocket-Protocol: " + protocol + "\r\n";
  if (!send(request + headers + "\r\n")) return out;
  const auto end = Clock::now() + kTestTimeout;
  std::size_t split = std::string::npos;
  while ((split = received_.find("\r\n\r\n")) == std::string::npos && fill(received_.size() + 1, end)) {
  }
  if (split == std::string::npos) return out;
  out.head = received_.substr(0, split + 2);
  received_.erase(0, split + 4);
  out.status = std::stoi(out.head.substr(out.head.find(' ') + 1));
  // The example of RFC 6455, section 1.3.
  if (out.status == 101) {
    EXPECT_NE(out.head.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), std::string::npos);
    return out;
  }
  while (fill(received_.size() + 1, end)) {
  }
  out.body = received_;
  return out;
}

std::string frame_bytes(std::string_view payload, Opcode opcode, Fin fin) {
  constexpr char kMask[4] = {'\x12', '\x34', '\x56', '\x78'};
  std::string out;
  out.push_back(static_cast<char>((fin == Fin::yes ? 0x80 : 0) | static_cast<int>(opcode)));
  if (payload.size() < 126) {
    out.push_back(static_cast<char>(0x80 | payload.size()));
  } else if (payload.size() < 65536) {
    out.push_back(static_cast<char>(0x80 | 126));
    for (const int shift : {8, 0}) out.push_back(static_cast<char>(payload.size() >> shift));
  } else {
    out.push_back(static_cast<char>(0x80 | 127));
    for (int shift = 56; shift >= 0; shift -= 8)
      out.push_back(static_cast<char>(static_cast<std::uint64_t>(payload.size()) >> shift));
  }
  out.append(kMask, 4);
  for (std::size_t i = 0; i < payload.size(); ++i) out.push_back(static_cast<char>(payload[i] ^ kMask[i % 4]));
  return out;
}

bool RawWebClient::send_frame(std::string_view payload, Opcode opcode, Fin fin) {
  return send(frame_bytes(payload, opcode, fin));
}

std::optional<WebFrame> RawWebClient::next_frame(std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  if (!fill(2, end)) return std::nullopt;
  const auto byte = [this](std::size_t i) {
    return static_cast<std::uint64_t>(static_cast<unsigned char>(received_[i]));
  };
  EXPECT_EQ(byte(1) & 0x80, 0U) << "a server does not mask";
  std::uint64_t length = byte(1) & 0x7f;
  std::size_t head = 2;
  if (length >= 126) {
    const std::size_t bytes = length == 126 ? 2 : 8;
    if (!fill(2 + bytes, end)) return std::nullopt;
    length = 0;
    for (std::size_t i = 0; i < bytes; ++i) length = length << 8 | byte(2 + i);
    head += bytes;
  }
  if (!fill(head + length, end)) return std::nullopt;
  EXPECT_NE(byte(0) & 0x80, 0U) << "the probe does not fragment";
  WebFrame out{static_cast<Opcode>(byte(0) & 0xf), received_.substr(head, length)};
  received_.erase(0, head + length);
  return out;
}

std::optional<std::string> RawWebClient::next(std::chrono::milliseconds timeout) {
  while (std::optional<WebFrame> frame = next_frame(timeout)) {
    if (frame->opcode == Opcode::binary) return frame->payload;
    if (frame->opcode == Opcode::ping) send_frame(frame->payload, Opcode::pong);
    if (frame->opcode == Opcode::close) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<WebFrame> RawWebClient::close_frame() {
  while (std::optional<WebFrame> frame = next_frame())
    if (frame->opcode == Opcode::close) return frame;
  return std::nullopt;
}

}  // namespace lightwell::test
