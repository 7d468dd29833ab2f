// A camera's loans, an estimator and a link that do what a test says.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "camera/frame.hpp"
#include "estimate/estimator.hpp"
#include "link/link.hpp"

namespace lightwell::test {

/// Lends frames without pictures, and knows which have not come back.
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

/// Upward radiance of `level`, so that the irradiance of any normal is pi times that.
[[nodiscard]] inline Descriptor constant_light(float level) {
  Descriptor d;
  const float c = level / 0.28209479F;
  d.radiance.c[0] = {c, c, c};
  d.coverage = 1;
  return d;
}

/// What the fake was told, and what it shall do. Any thread.
struct EstimatorScript {
  mutable std::mutex mutex;
  Status fail_with;  ///< ok: it does not fail.
  Flags flags;       ///< Of what it gives.
  float level = 1;   ///< Radiance before scaling.
  EstimatorConfig configured;
  std::vector<std::vector<std::uint64_t>> brackets;  ///< Sequences of the frames that came.
};

class FakeEstimator final : public Estimator {
 public:
  explicit FakeEstimator(EstimatorScript& script) : script_(script) {}

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    const std::lock_guard lock(script_.mutex);
    std::vector<std::uint64_t>& came = script_.brackets.emplace_back();
    for (const Frame& f : bracket) came.push_back(f.info.sequence);
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

 private:
  EstimatorScript& script_;
  RadianceScale scale_;
};

/// What a link got, and how its start shall go. Outlives the link. Any thread.
struct LinkLog {
  mutable std::mutex mutex;
  Status start_with;
  bool running = false;
  std::vector<EncodedDescriptor> published;
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
  void stop() override {
    const std::lock_guard lock(log_.mutex);
    log_.running = false;
  }
  LinkCounters counters() const override {
    const std::lock_guard lock(log_.mutex);
    return log_.counters;
  }
  std::string address() const override { return "fake://here"; }

 private:
  LinkLog& log_;
};

}  // namespace lightwell::test
