#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <random>
#include <utility>

#include <lightwell/deleter.hpp>
#include <lightwell/mqtt_session.hpp>

namespace lightwell {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
/// Keep alive interval (MQTT 5, 3.1.2.10). Without a packet, the broker treats a client as lost, and publishes its
/// will, after 1.5 intervals; the client treats the broker as lost after two.
constexpr int kKeepAliveSeconds = 5;

/// Password callback that rejects encrypted keys; without it OpenSSL prompts at the terminal.
int no_password(char*, int, int, void*) { return 0; }

const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

/// Whether the error can mean that the broker requires a client certificate. TLS 1.3 reports that after the handshake:
/// by an alert (116, RFC 8446; in TLS 1.2 alert 40, RFC 5246) if it is read in time, otherwise by a failed write
/// ("Protocol error" in libmosquitto) or a reset. Which of them is seen is a race, so all are recognised.
bool may_require_certificate(const std::string& why) {
  for (const char* sign : {"certificate required", "handshake failure", "connection to the broker was lost"})
    if (why.find(sign) != std::string::npos) return true;
  for (const int error : {EPROTO, ECONNRESET, EPIPE, ECONNABORTED})
    if (why == std::strerror(error)) return true;
  return why == mosquitto_strerror(MOSQ_ERR_CONN_LOST) || why == mosquitto_strerror(MOSQ_ERR_TLS);
}

}  // namespace

struct MqttSession::Callbacks {
  static void connected(mosquitto* client, void* data, int reason, int, const mosquitto_property*) {
    auto& self = *static_cast<MqttSession*>(data);
    if (reason != 0) {
      self.disconnected_ = std::string("the broker refused: ") + mosquitto_reason_string(reason);
      return;
    }
    self.connected_ = true;
    self.backoff_.reset();
    for (const std::string& topic : self.options_.subscriptions)
      mosquitto_subscribe_v5(client, nullptr, topic.c_str(), 0, 0, nullptr);
    self.options_.on_connected();
  }

  static void disconnected(mosquitto*, void* data, int reason, const mosquitto_property*) {
    auto& self = *static_cast<MqttSession*>(data);
    // Codes below 128 are the library's, the others are MQTT 5 reason codes of the broker.
    const std::string why = reason >= 128 ? mosquitto_reason_string(reason) : mosquitto_strerror(reason);
    if (self.disconnected_.empty()) self.disconnected_ = self.library_error_.empty() ? why : self.library_error_;
  }

  static void message(mosquitto*, void* data, const mosquitto_message* m, const mosquitto_property* properties) {
    char* topic = nullptr;
    void* correlation = nullptr;
    std::uint16_t correlation_size = 0;
    mosquitto_property_read_string(properties, MQTT_PROP_RESPONSE_TOPIC, &topic, false);
    mosquitto_property_read_binary(properties, MQTT_PROP_CORRELATION_DATA, &correlation, &correlation_size, false);
    // libmosquitto allocates both with malloc.
    const std::unique_ptr<void, Deleter<std::free>> owned_topic(topic), owned_correlation(correlation);
    const auto bytes = [](const void* at, std::size_t size) {
      return std::span(static_cast<const std::byte*>(at), size);
    };
    static_cast<MqttSession*>(data)->options_.on_message(
        {m->topic, bytes(m->payload, static_cast<std::size_t>(m->payloadlen)), topic != nullptr ? topic : "",
         bytes(correlation, correlation_size)});
  }

  static void subscribed(mosquitto*, void* data, int, int count, const int* granted, const mosquitto_property*) {
    auto& self = *static_cast<MqttSession*>(data);
    for (int i = 0; i < count; ++i)
      if (granted[i] >= 128)
        self.disconnected_ = std::string("the broker refused a subscription: ") + mosquitto_reason_string(granted[i]) +
                             "; check this user's read permission for these topics";
  }

  static void log(mosquitto*, void* data, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) static_cast<MqttSession*>(data)->library_error_ = text;
  }
};

void MqttSession::Free::operator()(mosquitto* client) const { mosquitto_destroy(client); }

MqttSession::MqttSession(Options options)
    : options_(std::move(options)), backoff_(options_.retry_min, options_.retry_max, std::random_device{}()) {
  // Once per process, without cleanup, because other parts of the process may use the library.
  static const int initialised = mosquitto_lib_init();
  (void)initialised;
}

std::string MqttSession::configure(mosquitto* client) const {
  const MqttLogin& login = options_.login;
  mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
  mosquitto_connect_v5_callback_set(client, Callbacks::connected);
  mosquitto_disconnect_v5_callback_set(client, Callbacks::disconnected);
  mosquitto_message_v5_callback_set(client, Callbacks::message);
  mosquitto_subscribe_v5_callback_set(client, Callbacks::subscribed);
  mosquitto_log_callback_set(client, Callbacks::log);
  int rc = MOSQ_ERR_SUCCESS;
  if (const Status s = check_plain_login(options_.address); !login.user.empty() && !s.ok()) return s.message();
  if (!login.user.empty()) rc = mosquitto_username_pw_set(client, login.user.c_str(), or_null(login.password));
  if (rc != MOSQ_ERR_SUCCESS) return std::string("user name or password: ") + mosquitto_strerror(rc);
  if (options_.address.transport == MqttTransport::tls) {
    if (login.ca_file.empty()) mosquitto_int_option(client, MOSQ_OPT_TLS_USE_OS_CERTS, 1);
    rc = mosquitto_tls_set(client, or_null(login.ca_file), nullptr, or_null(login.certificate_file),
                           or_null(login.key_file), no_password);
    if (rc == MOSQ_ERR_SUCCESS) rc = mosquitto_tls_opts_set(client, 1, "tlsv1.2", nullptr);
    if (rc != MOSQ_ERR_SUCCESS) return std::string("TLS files: ") + mosquitto_strerror(rc);
  }
  if (!options_.will_topic.empty())
    rc = mosquitto_will_set_v5(client, options_.will_topic.c_str(), static_cast<int>(options_.will_payload.size()),
                               options_.will_payload.data(), 0, true, nullptr);
  return rc == MOSQ_ERR_SUCCESS ? std::string() : std::string("last will: ") + mosquitto_strerror(rc);
}

void MqttSession::attempt(std::int64_t now_ns) {
  const char* const host = options_.address.host.c_str();
  library_error_.clear();
  disconnected_.clear();
  attempt_ns_ = now_ns;
  client_.reset(mosquitto_new(options_.login.client_id.c_str(), true, this));
  if (!client_) return handle_disconnect("out of memory");
  if (const std::string problem = configure(client_.get()); !problem.empty()) return handle_disconnect(problem);
  mosquitto_property* properties = nullptr;
  mosquitto_property_add_int32(&properties, MQTT_PROP_MAXIMUM_PACKET_SIZE, options_.largest_packet);
  // The non-blocking connect takes no properties. The blocking one stores them in the client, and then fails without
  // connecting, because port -1 is invalid.
  mosquitto_connect_bind_v5(client_.get(), host, -1, kKeepAliveSeconds, nullptr, properties);
  mosquitto_property_free_all(&properties);
  resolving_ = true;
  const int rc = mosquitto_connect_async(client_.get(), host, options_.address.port, kKeepAliveSeconds);
  const int system_error = errno;
  resolving_ = false;
  if (rc != MOSQ_ERR_SUCCESS) {
    const std::string system = rc == MOSQ_ERR_ERRNO ? std::strerror(system_error) : mosquitto_strerror(rc);
    return handle_disconnect(library_error_.empty() ? system : library_error_);
  }
  const int socket = mosquitto_socket(client_.get()), bytes = options_.send_buffer_bytes;
  if (socket >= 0 && bytes > 0) set_send_buffer(socket, bytes);
}

void MqttSession::handle_disconnect(std::string why) {
  if (!connected_ && options_.address.transport == MqttTransport::tls && may_require_certificate(why))
    why += "; does the broker ask for a certificate of ours?";
  client_.reset();
  connected_ = false;
  next_attempt_ns_ = monotonic_now_ns() + backoff_.next().ns;
  options_.on_lost(why);
}

bool MqttSession::idle() const { return connected_ && client_ && !mosquitto_want_write(client_.get()); }

void MqttSession::wake() const { wait_.wake(); }

void MqttSession::run_once(Duration timeout) {
  const std::int64_t now = monotonic_now_ns();
  if (!client_ && now >= next_attempt_ns_) attempt(now);
  if (!client_) {
    (void)wait_.wait(-1, {}, {std::min(timeout.ns, next_attempt_ns_ - monotonic_now_ns())});
    return;
  }
  const SocketEvents wanted{.writable = mosquitto_want_write(client_.get())};
  serve(wait_.wait(mosquitto_socket(client_.get()), wanted, {std::min(timeout.ns, kSecond)}));
  if (disconnected_.empty() && !connected_ && monotonic_now_ns() - attempt_ns_ > options_.connect_timeout.ns)
    disconnected_ = "the broker does not respond";
  if (!disconnected_.empty()) handle_disconnect(std::exchange(disconnected_, {}));
}

void MqttSession::serve(SocketEvents events) {
  mosquitto* const client = client_.get();
  if (events.failed) {
    if (std::string error = take_socket_error(mosquitto_socket(client)); !error.empty()) {
      disconnected_ = std::move(error);
      return;
    }
  }
  if (events.readable || events.failed) mosquitto_loop_read(client, 1);
  if (mosquitto_socket(client) >= 0 && mosquitto_want_write(client)) mosquitto_loop_write(client, 1);
  if (mosquitto_socket(client) >= 0) mosquitto_loop_misc(client);
  if (mosquitto_socket(client) < 0 && disconnected_.empty())
    disconnected_ = library_error_.empty() ? "the connection to the broker was lost" : library_error_;
}

bool MqttSession::send(const std::string& topic, std::span<const std::byte> payload, bool retained,
                       const std::string& response_topic, std::span<const std::byte> correlation) {
  mosquitto_property* properties = nullptr;
  int rc = client_ ? MOSQ_ERR_SUCCESS : MOSQ_ERR_NO_CONN;
  if (rc == MOSQ_ERR_SUCCESS && !response_topic.empty())
    rc = mosquitto_property_add_string(&properties, MQTT_PROP_RESPONSE_TOPIC, response_topic.c_str());
  if (rc == MOSQ_ERR_SUCCESS && !correlation.empty())
    rc = mosquitto_property_add_binary(&properties, MQTT_PROP_CORRELATION_DATA, correlation.data(),
                                       static_cast<std::uint16_t>(correlation.size()));
  if (rc == MOSQ_ERR_SUCCESS)
    rc = mosquitto_publish_v5(client_.get(), nullptr, topic.c_str(), static_cast<int>(payload.size()), payload.data(),
                              0, retained, properties);
  mosquitto_property_free_all(&properties);
  return rc == MOSQ_ERR_SUCCESS;
}

bool MqttSession::publish(const std::string& topic, std::span<const std::byte> payload, bool retained) {
  return send(topic, payload, retained, {}, {});
}

bool MqttSession::request(const std::string& topic, const std::string& response_topic,
                          std::span<const std::byte> correlation) {
  return connected_ && send(topic, {}, false, response_topic, correlation);
}

bool MqttSession::respond(const MqttMessage& request, std::span<const std::byte> payload) {
  return send(std::string(request.response_topic), payload, false, {}, request.correlation);
}

void MqttSession::close(Duration timeout) {
  const std::int64_t end = monotonic_now_ns() + timeout.ns;
  const auto flush = [&](auto&& done) {
    while (client_ && !done() && monotonic_now_ns() < end) {
      const int socket = mosquitto_socket(client_.get());
      if (socket < 0) return;
      serve(wait_.wait(socket, {.writable = true}, {20'000'000}));
      if (!disconnected_.empty()) return;
    }
  };
  if (connected_) {
    flush([&] { return idle(); });
    if (idle()) mosquitto_disconnect_v5(client_.get(), 0, nullptr);
    flush([&] { return mosquitto_socket(client_.get()) < 0; });
  }
  client_.reset();
  connected_ = false;
}

}  // namespace lightwell
