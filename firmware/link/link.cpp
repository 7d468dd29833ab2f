#include "link/link.hpp"

#include <lightwell/time.hpp>

namespace lightwell {

Status Publisher::start() {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (Status s = links_[i]->start(); !s.ok()) {
      while (i > 0) links_[--i]->stop();
      return s;
    }
  }
  return {};
}

void Publisher::stop() {
  for (const auto& link : links_) link->stop();
}

Status Publisher::publish(Descriptor& descriptor) {
  descriptor.time.encoded_after = ProbeTime{monotonic_now_ns()} - descriptor.time.mid_exposure;
  const Result<std::span<const std::byte>> bytes = encoder_.encode(descriptor);
  if (!bytes) return bytes.status();
  encoded_ns_ = monotonic_now_ns();
  const auto shared = std::make_shared<const std::vector<std::byte>>(bytes->begin(), bytes->end());
  for (const auto& link : links_) link->publish(shared);
  for (MessageSink* const sink : sinks_) sink->publish(shared);
  return {};
}

Status Publisher::publish_plane(const CapturedPlane& plane) {
  const auto changes = plane_encoder_.encode(plane, {monotonic_now_ns()});
  if (!changes) return changes.status();
  auto encoded = std::make_shared<EncodedPlane>();
  encoded->changes.assign(changes->begin(), changes->end());
  const auto whole = plane_encoder_.whole();
  encoded->whole.assign(whole.begin(), whole.end());
  for (const auto& link : links_) link->publish_plane(encoded);
  for (MessageSink* const sink : sinks_) sink->publish_plane(encoded);
  return {};
}

LinkCounters Publisher::counters() const {
  LinkCounters sum;
  for (const auto& link : links_) {
    const LinkCounters c = link->counters();
    sum.clients += c.clients;
    sum.coalesced += c.coalesced;
    sum.messages_refused += c.messages_refused;
    sum.authentication_failures += c.authentication_failures;
    sum.client_list_faults += c.client_list_faults;
  }
  return sum;
}

}  // namespace lightwell
