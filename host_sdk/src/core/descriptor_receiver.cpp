#include "core/descriptor_receiver.hpp"

#include <chrono>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/text.hpp>

#include "core/sample.hpp"

namespace lightwell::core {
namespace {

std::string in_seconds(Duration d) {
  std::string text = std::to_string(d.seconds());
  text.erase(text.find('.') + 3);
  return text + " s";
}

}  // namespace

DescriptorReceiver::DescriptorReceiver(const ProbeOptions& options)
    : capacity_(static_cast<std::size_t>(options.history)),
      max_age_(options.max_age),
      extrapolation_(options.extrapolation),
      on_descriptor_(options.on_descriptor),
      on_plane_(options.on_plane) {}

void DescriptorReceiver::describe(const ProbeInfo& info) {
  if (!info.T_world_probe)
    T_world_probe_.reset();
  else if (!T_world_probe_ || *T_world_probe_ != *info.T_world_probe)
    T_world_probe_ = std::make_shared<const UncertainPose>(*info.T_world_probe);
  const std::lock_guard lock(mutex_);
  info_ = info;
  described_ = true;
  changed_.notify_all();
}

void DescriptorReceiver::receive(std::span<const std::byte> bytes, HostTime received, const HostTimeOf& host_time_of) {
  Result<Descriptor> decoded = decode_descriptor(bytes);
  if (!decoded.ok()) return drop(stats_.undecodable, decoded.status().message());
  const std::optional<MappedTime> mapped = host_time_of(decoded->time);
  const auto name = [&] { return "descriptor " + std::to_string(decoded->sequence); };
  if (!mapped) return drop(stats_.untimely, name() + " is not newer than an earlier one, or is dated in the future");
  if (is_duplicate(*decoded)) return drop(stats_.replayed, name() + " was received again after a newer one");
  newest_ = {decoded->probe_id, decoded->sequence, decoded->time.mid_exposure};
  auto sample = std::make_shared<Sample>(sample_of(std::move(*decoded)));
  sample->mid_exposure = mapped->at;
  sample->time_uncertainty = mapped->uncertainty;
  sample->received = received;
  sample->encoded_bytes = bytes.size();
  sample->T_world_probe = T_world_probe_;
  const bool understood = environments_.take(sample->descriptor);
  sample->environment = environments_.map_for(sample->descriptor);
  if (sample->environment) sample->environment_rotation = map_rotation(sample->descriptor, *sample->environment);
  add_reconstruction(*sample);
  const std::shared_ptr<const Sample> shared = std::move(sample);
  const std::shared_ptr<const Sample> before = history_ ? history_->samples.back() : nullptr;
  history_ = appended(history_.get(), shared, capacity_);
  store_.publish(history_);
  const HostTime stored{monotonic_now_ns()};
  count(shared->descriptor, bytes.size(), understood);
  if (on_descriptor_) on_descriptor_({bytes, shared->descriptor, shared->mid_exposure, received, stored});
  reconstruct_ahead_.published(before ? before->reconstruction.get() : nullptr, shared->reconstruction.get());
}

void DescriptorReceiver::drop(std::uint64_t& counter, const std::string& why) {
  const std::lock_guard lock(mutex_);
  ++counter;
  stats_.last_error = why;
}

bool DescriptorReceiver::is_duplicate(const Descriptor& descriptor) const {
  // A restarted daemon counts from the start again, but the clock of its machine continues.
  return newest_ && descriptor.probe_id == newest_->probe_id && descriptor.sequence <= newest_->sequence &&
         descriptor.time.mid_exposure <= newest_->mid_exposure;
}

void DescriptorReceiver::count(const Descriptor& descriptor, std::size_t bytes, bool map_understood) {
  const std::lock_guard lock(mutex_);
  ++stats_.received;
  stats_.bytes += bytes;
  if (descriptor.environment) ++(map_understood ? stats_.maps : stats_.maps_without_key);
  // If the sequence number does not increase, the probe was restarted and the number of missing captures is unknown.
  if (newest_sequence_ && descriptor.sequence > *newest_sequence_)
    stats_.gaps += descriptor.sequence - *newest_sequence_ - 1;
  newest_sequence_ = descriptor.sequence;
  changed_.notify_all();
}

void DescriptorReceiver::receive_plane(std::span<const std::byte> bytes, HostTime received,
                                       const PlaneVerdictOf& verdict_of) {
  using Verdict = PlaneReplayProtection::Verdict;
  const Result<PlaneUpdate> update = decode_plane_update(bytes);
  const Verdict verdict = update && verdict_of ? verdict_of(update->info) : Verdict::same_capture;
  if (verdict == Verdict::refused)
    return drop(stats_.untimely, "a message of a plane is of an earlier capture, or is dated in the future");
  const bool stuck =
      verdict_of && plane_current_ && received - *plane_current_ > PlaneReplayProtection::kCaptureTimeout;
  if (verdict == Verdict::other_capture || stuck) restart_plane();
  if (const Status s = plane_reader_.take_update(update, received); !s.ok()) return refuse(s.message());
  if (on_plane_) on_plane_({bytes, received});
  if (!plane_current_) plane_current_ = received;
  // An update is several messages; until they are there, the former state is the better one.
  if (!plane_reader_.complete()) return;
  const std::shared_ptr<const PlaneState> state = plane_reader_.state();
  if (state->revision == update->revision) plane_current_ = received;
  planes_.publish(state);
}

void DescriptorReceiver::refuse_oversized(std::size_t bytes) {
  drop(stats_.oversized, "a message of " + std::to_string(bytes) + " bytes; a descriptor has at most " +
                             std::to_string(kMaxDescriptorBytes));
}

void DescriptorReceiver::set_frame_counters(std::uint64_t lost, std::uint64_t refused) {
  const std::lock_guard lock(mutex_);
  stats_.frames_lost = lost;
  stats_.frames_refused = refused;
}

void DescriptorReceiver::refuse(const std::string& why) { drop(stats_.undecodable, printable(why)); }

void DescriptorReceiver::set_state(LinkState state) {
  const std::lock_guard lock(mutex_);
  if (state == LinkState::connected && stats_.state != LinkState::connected) {
    reset_sequence();
    if (was_connected_) ++stats_.reconnects;
    was_connected_ = true;
  }
  stats_.state = state;
  changed_.notify_all();
}

void DescriptorReceiver::report_error(const std::string& error) {
  const std::lock_guard lock(mutex_);
  stats_.last_error = printable(error);
}

Lighting DescriptorReceiver::latest(HostTime now) const { return newest_lighting(store_.read().get(), now, max_age_); }

Lighting DescriptorReceiver::at(HostTime time) const {
  return lighting_at(store_.read().get(), time, max_age_, extrapolation_);
}

Status DescriptorReceiver::wait_until_described(Duration timeout) const {
  std::unique_lock lock(mutex_);
  if (changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return described_; })) return {};
  return {StatusCode::unavailable, "no answer within " + in_seconds(timeout) +
                                       (stats_.last_error.empty() ? std::string() : " (" + stats_.last_error + ")")};
}

Status DescriptorReceiver::wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const {
  std::unique_lock lock(mutex_);
  const auto come = [&] { return newest_sequence_ && newest_sequence_ != seen; };
  const auto over = [&] { return stats_.state == LinkState::ended; };
  changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return come() || over(); });
  if (come()) return {};
  if (over()) return {StatusCode::failed_precondition, "the recording has ended"};
  return {StatusCode::unavailable, "no new descriptor within " + in_seconds(timeout)};
}

ProbeInfo DescriptorReceiver::info() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

LinkStats DescriptorReceiver::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

}  // namespace lightwell::core
