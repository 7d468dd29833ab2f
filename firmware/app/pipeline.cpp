#include "app/pipeline.hpp"

#include <cmath>
#include <pthread.h>
#include <utility>

#include <lightwell/query.hpp>
#include <lightwell/time.hpp>

namespace lightwell {
namespace {

/// From one update of a captured plane to the next, at least. Clients know from its key interval, 10 s by default, when
/// to expect one.
constexpr std::chrono::seconds kPlaneInterval(1);

}  // namespace

void BracketSlot::push(Frame frame) {
  Bracket replaced, incomplete;  // Released after the lock, because a backend's release() must not run under it.
  {
    const std::lock_guard lock(mutex_);
    // Only a forward jump is a loss: a restarted camera may begin again at 0.
    if (counts_.frames > 0 && frame.info.sequence > last_sequence_ + 1)
      counts_.lost += frame.info.sequence - last_sequence_ - 1;
    last_sequence_ = frame.info.sequence;
    ++counts_.frames;
    if (closed_) return;
    const int index = frame.info.bracket_index, size = frame.info.bracket_size;
    const std::uint64_t first = frame.info.sequence - static_cast<std::uint64_t>(index);
    const bool continues = index > 0 && static_cast<std::size_t>(index) == filling_.frames().size() &&
                           filling_.frames().back().info.sequence + 1 == frame.info.sequence;
    if (!continues) {
      if (!filling_.empty()) count_incomplete(filling_.frames().front().info.sequence);
      incomplete = std::move(filling_);
    }
    if (index > 0 && !continues) {
      // An exposure is missing, so the rest of this bracket is discarded, too.
      count_incomplete(first);
      return;
    }
    filling_.add(std::move(frame));
    if (index + 1 < size) return;
    if (!whole_.empty()) ++counts_.dropped;
    replaced = std::move(whole_);
    whole_ = std::move(filling_);
  }
  ready_.notify_one();
}

void BracketSlot::count_incomplete(std::uint64_t first_sequence) {
  if (last_incomplete_ == first_sequence) return;
  last_incomplete_ = first_sequence;
  ++counts_.incomplete;
}

bool BracketSlot::take(Bracket& out) {
  out.clear();
  std::unique_lock lock(mutex_);
  ready_.wait(lock, [this] { return closed_ || !whole_.empty(); });
  return take_locked(lock, out) == Taken::bracket;
}

BracketSlot::Taken BracketSlot::take_before(std::chrono::steady_clock::time_point limit, Bracket& out) {
  out.clear();
  std::unique_lock lock(mutex_);
  ready_.wait_until(lock, limit, [this] { return closed_ || !whole_.empty(); });
  return take_locked(lock, out);
}

BracketSlot::Taken BracketSlot::take_locked(std::unique_lock<std::mutex>& lock, Bracket& out) {
  if (closed_) return Taken::closed;
  if (whole_.empty()) return Taken::nothing;
  out = std::move(whole_);
  lock.unlock();
  space_available_.notify_one();
  return Taken::bracket;
}

bool BracketSlot::wait_for_space(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  return space_available_.wait(lock, std::move(stop), [this] { return !closed_ && whole_.empty(); });
}

void BracketSlot::close() {
  Bracket filling, whole;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    filling = std::move(filling_);
    whole = std::move(whole_);
  }
  ready_.notify_all();
}

BracketSlot::Counts BracketSlot::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

Pipeline::Pipeline(StatusSnapshot identity, std::unique_ptr<Estimator> estimator, const EstimatorConfig& config,
                   Limits limits, const PlaneEncoderOptions& planes)
    : identity_(std::move(identity)),
      publisher_(planes),
      estimator_(std::move(estimator)),
      kind_(estimator_->kind()),
      time_governor_(Governed::duration, limits.budget_ms, config.setting),
      bound_governor_(Governed::bound, limits.max_bound, config.setting),
      used_{config.setting},
      config_(config),
      health_{{}, config.setting, {}, {}} {
  newest_.lights.reserve(kMaxLights);
  newest_clipped_.reserve(kMaxLights + 1);
}

Pipeline::~Pipeline() { stop(); }

Status Pipeline::start() {
  if (Status s = publisher_.start(); !s.ok()) return s;
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), "estimator");
    run();
  });
  return {};
}

void Pipeline::stop() {
  slot_.close();
  if (!thread_.joinable()) return;
  thread_.join();
  publisher_.stop();
}

void Pipeline::run() {
  Bracket bracket;
  Descriptor descriptor;
  descriptor.lights.reserve(kMaxLights);
  while (take(bracket)) {
    configure_estimator();
    const std::int64_t start_ns = monotonic_now_ns();
    Status status = estimator_->estimate(bracket.frames(), descriptor);
    if (status.ok()) {
      // Before it is published: a client that has received it may report a lux reading for it at once.
      keep_newest(descriptor);
      status = publisher_.publish(descriptor);
    }
    // After the descriptor was sent; also where there is none, because the picture shows why.
    if (preview_ != nullptr) preview_->offer(bracket.frames());
    bracket.clear();
    if (status.ok())
      update_governors(static_cast<double>(publisher_.encoded_ns() - start_ns) * 1e-6,
                       static_cast<double>(descriptor.bound.total));
    // The counters are incremented last, so that a reader of the count also sees its result.
    if (status.ok()) {
      estimates_.fetch_add(1, std::memory_order_release);
    } else {
      keep_error(status);
      failed_.fetch_add(1, std::memory_order_release);
    }
    plane_changed_ = true;
    publish_plane();
  }
}

bool Pipeline::take(Bracket& out) {
  while (plane_published_ && plane_changed_) {
    const BracketSlot::Taken taken = slot_.take_before(*plane_published_ + kPlaneInterval, out);
    if (taken != BracketSlot::Taken::nothing) return taken == BracketSlot::Taken::bracket;
    plane_changed_ = false;
    publish_plane();
  }
  return slot_.take(out);
}

void Pipeline::publish_plane() {
  const auto now = std::chrono::steady_clock::now();
  if (plane_published_ && now - *plane_published_ < kPlaneInterval) return;
  const CapturedPlane* const plane = estimator_->captured_plane();
  if (plane == nullptr) return;
  plane_published_ = now;
  plane_changed_ = false;
  if (const Status s = publisher_.publish_plane(*plane); !s.ok()) keep_error(s);
}

void Pipeline::keep_error(const Status& status) {
  const std::lock_guard lock(mutex_);
  health_.last_error = status.message();
}

void Pipeline::keep_newest(Descriptor& descriptor) {
  const std::lock_guard lock(mutex_);
  // newest_ is stored without its environment map, because a copy of it would allocate.
  std::optional<EnvironmentMap> map;
  map.swap(descriptor.environment);
  newest_ = descriptor;
  map.swap(descriptor.environment);
  newest_factor_ = estimator_->scale().factor;
  const std::span<const ClippedLight> clipped = estimator_->clipped_lights();
  newest_clipped_.assign(clipped.begin(), clipped.end());
  has_newest_ = true;
}

void Pipeline::configure_estimator() {
  const std::lock_guard lock(mutex_);
  if (config_changed_) {
    time_governor_.restart(config_.setting);
    bound_governor_.restart(config_.setting);
  }
  if (config_changed_ || used_ != point()) {
    EstimatorConfig config = config_;
    used_ = point();
    config.setting = used_.setting;
    config.panorama.interleave = std::max(config.panorama.interleave, used_.interleave);
    // Cannot fail: update_estimator() has validated it.
    (void)estimator_->configure(config);
  }
  if (scale_changed_) estimator_->set_scale(scale_);
  if (recovery_changed_) estimator_->set_recovery(recovery_);
  config_changed_ = scale_changed_ = recovery_changed_ = false;
}

OperatingPoint Pipeline::point() const {
  const OperatingPoint in_time = time_governor_.point(), in_bound = bound_governor_.point();
  return !bound_governor_.active() || is_cheaper(in_time, in_bound) ? in_time : in_bound;
}

void Pipeline::update_governors(double ms, double bound) {
  // Each learns from estimates at the point that it chose.
  if (used_ == time_governor_.point()) time_governor_.record(ms);
  if (used_ == bound_governor_.point()) bound_governor_.record(bound);
  const auto update = [](const Governor& governor, std::optional<double>& exceeded) {
    if (!governor.exceeds_everywhere())
      exceeded.reset();
    else if (!exceeded)
      exceeded = governor.typical();
  };
  const std::lock_guard lock(mutex_);
  health_.setting = point().setting;
  governor_counts_ = time_governor_.counts();
  governor_counts_.moves += bound_governor_.counts().moves;
  update(time_governor_, health_.over_budget_ms);
  update(bound_governor_, health_.over_bound);
}

Pipeline::Health Pipeline::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

StatusSnapshot Pipeline::status() const {
  StatusSnapshot s = identity_;
  s.counters = {};
  const BracketSlot::Counts slot = slot_.counts();
  const LinkCounters links = publisher_.counters();
  s.counters.frames = slot.frames;
  s.counters.frames_lost = slot.lost;
  s.counters.captures_dropped = slot.dropped;
  s.counters.brackets_incomplete = slot.incomplete;
  s.counters.estimates = estimates_.load(std::memory_order_acquire);
  s.counters.estimates_failed = failed_.load(std::memory_order_acquire);
  s.counters.descriptors_coalesced = links.coalesced;
  s.counters.clients = links.clients;
  s.counters.messages_refused = links.messages_refused;
  s.counters.authentication_failures = links.authentication_failures;
  s.counters.client_list_faults = links.client_list_faults;
  {
    const std::lock_guard lock(mutex_);
    s.counters.setting_moves = governor_counts_.moves;
    s.counters.estimates_late = governor_counts_.exceeded;
    s.counters.estimates_late_at_fast = governor_counts_.exceeded_first;
    s.temperature_c = temperature_c_;
  }
  if (recorder_ != nullptr) {
    s.counters.frames_recorded = recorder_->recorded();
    s.counters.recording_faults = recorder_->faults() + recorder_->skipped();
  }
  for (const auto& link : publisher_.links()) {
    const LinkCounters c = link->counters();
    s.links.push_back({std::string(link->name()), c.clients, c.coalesced, c.messages_refused, c.authentication_failures,
                       !link->error_message().empty()});
  }
  if (recordings_ != nullptr) s.recording = recordings_->status();
  return s;
}

void Pipeline::set_temperature(std::optional<float> temperature_c) {
  const std::lock_guard lock(mutex_);
  temperature_c_ = temperature_c;
}

void Pipeline::set_recordings(ProbeRecorder* recordings) {
  recordings_ = recordings;
  if (recordings != nullptr) publisher_.add_sink(*recordings);
}

Result<RecordingStatus> Pipeline::control_recording(RecordingAction action) {
  if (recordings_ != nullptr) return recordings_->control(action);
  return Status(StatusCode::failed_precondition,
                "this probe records nothing, because its owner has configured no folder for that: set recordings { "
                "folder: \"FOLDER\" } in its configuration (or --recordings) and restart lightwelld");
}

Result<PreviewJpeg> Pipeline::preview() {
  if (preview_ != nullptr) return preview_->request();
  return Status(StatusCode::failed_precondition,
                "this probe shows no pictures, because its owner lets nobody have them: set images: "
                "IMAGE_RECIPIENTS_ALL_CLIENTS in its configuration and restart lightwelld");
}

EstimatorConfig Pipeline::estimator() const {
  const std::lock_guard lock(mutex_);
  return config_;
}

Status Pipeline::update_estimator(const EstimatorUpdate& update) {
  // Read-modify-write under one lock, because clients of several links may change fields concurrently.
  const std::lock_guard lock(mutex_);
  const EstimatorConfig config = updated(config_, update);
  if (Status s = config.validate(kind_); !s.ok()) return s;
  config_ = config;
  config_changed_ = true;
  return {};
}

Result<double> Pipeline::report_lux(double lux, Vec3d normal) {
  const std::lock_guard lock(mutex_);
  if (!has_newest_) return Status(StatusCode::failed_precondition, "no light has been measured yet");
  // With a known scale, the difference between reading and estimate is attributed to clipped lights.
  if (newest_.flags.has(Flag::clipped) && newest_.units == Units::absolute && !scale_changed_)
    return recover_clipped_from_lux(lux, normal);
  for (const Flag flag : {Flag::unseen, Flag::clipped, Flag::dark})
    if (newest_.flags.has(flag) && !(flag == Flag::clipped && newest_.flags.has(Flag::recovered)))
      return Status(StatusCode::failed_precondition,
                    "the measured light is too uncertain to set a scale: " + std::string(to_string(flag)));
  const double measured = irradiance_at(newest_, vec_cast<float>(normal)).luminance();
  if (!(measured > 0))
    return Status(StatusCode::failed_precondition, "the measured irradiance in the meter's direction is zero");
  const double factor = newest_factor_ * lux / measured;
  if (!(factor > 0) || !std::isfinite(factor))
    return Status(StatusCode::invalid_argument, "the reading gives no scale: " + std::to_string(factor));
  scale_ = {Units::absolute, factor};
  scale_changed_ = true;
  return factor;
}

Result<double> Pipeline::recover_clipped_from_lux(double lux, Vec3d normal) {
  if (newest_.flags.has(Flag::unseen))
    return Status(StatusCode::failed_precondition,
                  "the missing part of the reading may come from directions that the camera does not see: unseen");
  if (Status s = status_of(recover(newest_, newest_clipped_, {vec_cast<float>(normalized(normal)), lux}, recovery_));
      !s.ok())
    return s;
  recovery_changed_ = true;
  return newest_factor_;
}

}  // namespace lightwell
