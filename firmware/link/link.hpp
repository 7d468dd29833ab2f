// Interface of an output of the probe, which accepts encoded descriptors without blocking the estimator, and the
// publisher, which encodes each descriptor once and passes the bytes to all links.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// One encoded message, immutable and shared by all links.
using EncodedMessage = std::shared_ptr<const std::vector<std::byte>>;
/// One encoded descriptor.
using EncodedDescriptor = EncodedMessage;

/// One update of a captured plane, immutable and shared by all links.
struct EncodedPlane {
  using Messages = std::vector<std::vector<std::byte>>;
  Messages changes;  ///< For clients that received all updates before.
  Messages whole;    ///< For all others.
};

/// Statistics of a link since its start; `clients` is the current number.
struct LinkCounters {
  std::uint32_t clients = 0;
  /// Descriptors that a client did not receive, because a newer one replaced them while it was slow; for MQTT also
  /// those that the broker's maximum size or a lost connection kept back.
  std::uint64_t coalesced = 0;
  /// Messages from clients that were malformed, incomplete, damaged, too large, misaddressed, replayed or too frequent.
  std::uint64_t messages_refused = 0;
  std::uint64_t authentication_failures = 0;  ///< Calls without a valid token or certificate.
  std::uint64_t client_list_faults = 0;       ///< Changes of the client list that could not be read.
};

/// Receives each message that the publisher has encoded.
class MessageSink {
 public:
  virtual ~MessageSink() = default;

  /// Keeps the descriptor and returns, without waiting for a network or a disk. Called from one publishing thread.
  virtual void publish(const EncodedDescriptor& descriptor) = 0;
  /// The same for the update of a captured plane. Called from one thread. By default ignored.
  virtual void publish_plane(const std::shared_ptr<const EncodedPlane>& /*plane*/) {}
};

class Link : public MessageSink {
 public:
  /// resource_exhausted or unavailable: the port or device cannot be used; the message names it and the remedy.
  [[nodiscard]] virtual Status start() = 0;
  /// Queues the descriptor and returns; a full queue drops its oldest entry and counts it. Called from one publishing
  /// thread, between start() and stop().
  void publish(const EncodedDescriptor& descriptor) override = 0;
  /// Queues the update of a captured plane and returns. A slow client misses updates and then receives the newest one
  /// whole (a broker that is slow, or was away, too). Called from one thread, between start() and stop(). Links without
  /// a stream of planes ignore it.
  void publish_plane(const std::shared_ptr<const EncodedPlane>& /*plane*/) override {}
  /// Ends the service of all clients; returns within a second.
  virtual void stop() = 0;

  [[nodiscard]] virtual LinkCounters counters() const = 0;
  /// The address for clients, for example "grpc://127.0.0.1:7420". Valid after start().
  [[nodiscard]] virtual std::string address() const = 0;
  /// The kind of link: its field in Config ("grpc").
  [[nodiscard]] virtual std::string_view name() const = 0;
  /// The present fault as text for people, empty without one. A link that depends on a third party (a broker) starts
  /// without it and reports it here; a link whose files are damaged continues with their last valid content and reports
  /// that here.
  [[nodiscard]] virtual std::string error_message() const { return {}; }
};

/// publish() is called from one thread. All links are added before the first publish().
class Publisher {
 public:
  /// `planes`: of publish_plane(); by default clients receive no images.
  explicit Publisher(const PlaneEncoderOptions& planes = {}) : plane_encoder_(planes) {}

  void add(std::unique_ptr<Link> link) { links_.push_back(std::move(link)); }
  /// A sink that is no link, which receives messages after all links. It must outlive the last publish().
  void add_sink(MessageSink& sink) { sinks_.push_back(&sink); }

  /// Starts all links in order. If one fails, stops those already started and returns its status.
  [[nodiscard]] Status start();
  void stop();

  /// Sets time.encoded_after of `descriptor`, encodes it (without allocation up to this point) and passes it to the
  /// links.
  [[nodiscard]] Status publish(Descriptor& descriptor);
  /// Encodes the changes of a captured plane and passes them to the links; a few milliseconds. From one thread, which
  /// may be another than that of publish(). Call it at least once in each key interval, also if nothing has changed:
  /// tiles are repeated by the time of the call, and clients take longer silence for a lost probe. Errors: those of
  /// PlaneEncoder::encode().
  [[nodiscard]] Status publish_plane(const CapturedPlane& plane);
  /// CLOCK_MONOTONIC, ns, when the last descriptor was encoded, before it was passed to a link.
  [[nodiscard]] std::int64_t encoded_ns() const { return encoded_ns_; }

  /// Sums over all links.
  [[nodiscard]] LinkCounters counters() const;
  [[nodiscard]] const std::vector<std::unique_ptr<Link>>& links() const { return links_; }

 private:
  Encoder encoder_;
  PlaneEncoder plane_encoder_;
  std::int64_t encoded_ns_ = 0;
  std::vector<std::unique_ptr<Link>> links_;
  std::vector<MessageSink*> sinks_;
};

}  // namespace lightwell
