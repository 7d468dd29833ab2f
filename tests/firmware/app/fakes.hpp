// Fake frame owner, estimator and link, controlled by a test.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/time.hpp>

#include "estimate/estimator.hpp"
#include "imaging/frame.hpp"
#include "link/link.hpp"

namespace lightwell::test {

/// Creates frames without pictures and counts those not yet released.
class Lender final : public FrameOwner {
 public:
  [[nodiscard]] Frame frame(std::uint64_t sequence, int bracket_index = 0, int bracket_size = 1) {
    ++lent_;
    Frame f(*this, 0);
    f.info.sequence = sequence;
    f.info.bracket_index = bracket_index;
    f.info.bracket_size = bracket_size;
    return f;
  }
  void release(int /*slot*/) override { --lent_; }
  [[nodiscard]] int lent() const { return lent_; }

 private:
  std::atomic<int> lent_{0};
};

/// Constant radiance `level`, so that the irradiance of any normal is pi times that.
[[nodiscard]] inline Descriptor constant_light(float level) {
  Descriptor d;
  const float c = level / 0.28209479F;
  d.radiance.c[0] = {c, c, c};
  d.coverage = 1;
  return d;
}

/// Behaviour of FakeEstimator and a record of its calls. Any thread.
struct EstimatorScript {
  mutable std::mutex mutex;
  Status fail_with;  ///< Result of estimate() if not ok.
  Flags flags;       ///< Flags of the descriptors.
  float level = 1;   ///< Radiance before scaling.
  EstimatorConfig configured;
  std::optional<CapturedPlane> plane;                ///< Result of captured_plane().
  std::vector<std::vector<std::uint64_t>> brackets;  ///< Sequence numbers of the frames of each call.
};

class FakeEstimator final : public Estimator {
 public:
  explicit FakeEstimator(EstimatorScript& script) : script_(script) {}

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    const std::lock_guard lock(script_.mutex);
    std::vector<std::uint64_t>& sequences = script_.brackets.emplace_back();
    for (const Frame& f : bracket) sequences.push_back(f.info.sequence);
    if (!script_.fail_with.ok()) return script_.fail_with;
    out = constant_light(script_.level * static_cast<float>(scale_.factor));
    out.sequence = bracket.front().info.sequence;
    out.units = scale_.units;
    out.flags = script_.flags;
    return {};
  }
  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig& config) override {
    const std::lock_guard lock(script_.mutex);
    script_.configured = config;
    return {};
  }
  void set_scale(RadianceScale scale) override { scale_ = scale; }
  RadianceScale scale() const override { return scale_; }
  const CapturedPlane* captured_plane() override {
    const std::lock_guard lock(script_.mutex);
    if (!script_.plane) return nullptr;
    plane_ = *script_.plane;
    return &plane_;
  }

 private:
  EstimatorScript& script_;
  RadianceScale scale_;
  CapturedPlane plane_;
};

/// Behaviour of FakeLink and a record of its calls. Outlives the link. Any thread.
struct LinkLog {
  mutable std::mutex mutex;
  Status start_with;
  bool running = false;
  std::vector<EncodedDescriptor> published;
  struct PublishedPlane {
    std::shared_ptr<const EncodedPlane> plane;
    std::int64_t at_ns = 0;  ///< CLOCK_MONOTONIC.
  };
  std::vector<PublishedPlane> planes;
  LinkCounters counters;

  [[nodiscard]] std::size_t count() const {
    const std::lock_guard lock(mutex);
    return published.size();
  }
  [[nodiscard]] std::vector<std::byte> last() const {
    const std::lock_guard lock(mutex);
    return published.empty() ? std::vector<std::byte>() : *published.back();
  }
};

class FakeLink final : public Link {
 public:
  explicit FakeLink(LinkLog& log) : log_(log) {}

  Status start() override {
    const std::lock_guard lock(log_.mutex);
    log_.running = log_.start_with.ok();
    return log_.start_with;
  }
  void publish(const EncodedDescriptor& descriptor) override {
    const std::lock_guard lock(log_.mutex);
    log_.published.push_back(descriptor);
  }
  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override {
    const std::lock_guard lock(log_.mutex);
    log_.planes.push_back({plane, monotonic_now_ns()});
  }
  void stop() override {
    const std::lock_guard lock(log_.mutex);
    log_.running = false;
  }
  LinkCounters counters() const override {
    const std::lock_guard lock(log_.mutex);
    return log_.counters;
  }
  std::string_view name() const override { return "fake"; }
  std::string address() const override { return "fake://here"; }

 private:
  LinkLog& log_;
};

}  // namespace lightwell::test
