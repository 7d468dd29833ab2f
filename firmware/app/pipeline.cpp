#include "app/pipeline.hpp"

#include <cmath>
#include <lightwell/query.hpp>

namespace lightwell {

Pipeline::Pipeline(ProbeIdentity identity, std::unique_ptr<Estimator> estimator, const EstimatorConfig& config)
    : identity_(std::move(identity)), estimator_(std::move(estimator)), config_(config) {
  newest_.lights.reserve(kMaxLights);
}

Pipeline::~Pipeline() { stop(); }

Status Pipeline::start() {
  if (Status s = publisher_.start(); !s.ok()) return s;
  thread_ = std::thread([this] { run(); });
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
  while (slot_.take(bracket)) {
    {
      const std::lock_guard lock(mutex_);
      // Both were checked when they were set.
      if (config_changed_) (void)estimator_->configure(config_);
      if (scale_changed_) estimator_->set_scale(scale_);
      config_changed_ = scale_changed_ = false;
    }
    Status status = estimator_->estimate(bracket.frames(), descriptor);
    if (status.ok()) status = publisher_.publish(descriptor);
    bracket.clear();
    // Counted last: who sees the count finds what was counted.
    if (status.ok()) {
      {
        const std::lock_guard lock(mutex_);
        newest_ = descriptor;
        newest_factor_ = estimator_->scale().factor;
        has_newest_ = true;
      }
      estimates_.fetch_add(1, std::memory_order_release);
    } else {
      {
        const std::lock_guard lock(mutex_);
        last_error_ = status.message();
      }
      failed_.fetch_add(1, std::memory_order_release);
    }
  }
}

std::string Pipeline::last_error() const {
  const std::lock_guard lock(mutex_);
  return last_error_;
}

StatusSnapshot Pipeline::status() const {
  StatusSnapshot s;
  s.probe_name = identity_.name;
  s.probe_id = identity_.probe_id;
  s.calibration_id = identity_.calibration_id;
  s.version = identity_.version;
  s.camera = identity_.camera;
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
  if (recorder_ != nullptr) {
    s.counters.frames_recorded = recorder_->recorded();
    s.counters.recording_faults = recorder_->faults() + recorder_->skipped();
  }
  return s;
}

EstimatorConfig Pipeline::estimator() const {
  const std::lock_guard lock(mutex_);
  return config_;
}

Status Pipeline::set_estimator(const EstimatorConfig& config) {
  if (Status s = config.validate(); !s.ok()) return s;
  const std::lock_guard lock(mutex_);
  config_ = config;
  config_changed_ = true;
  return {};
}

Result<double> Pipeline::report_lux(double lux, Vec3d normal) {
  const std::lock_guard lock(mutex_);
  if (!has_newest_) return Status(StatusCode::failed_precondition, "no light has been measured yet");
  for (const Flag flag : {Flag::unseen, Flag::clipped, Flag::dark})
    if (newest_.flags.has(flag))
      return Status(StatusCode::failed_precondition,
                    "the light is not known well enough to set a scale by it: " + std::string(to_string(flag)));
  const double measured = irradiance_at(newest_, vec_cast<float>(normal)).luminance();
  if (!(measured > 0)) return Status(StatusCode::failed_precondition, "no light is measured where the meter faces");
  const double factor = newest_factor_ * lux / measured;
  if (!(factor > 0) || !std::isfinite(factor))
    return Status(StatusCode::invalid_argument, "the reading gives no scale: " + std::to_string(factor));
  scale_ = {Units::absolute, factor};
  scale_changed_ = true;
  return factor;
}

}  // namespace lightwell
