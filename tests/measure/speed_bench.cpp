#include "measure/speed_bench.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>

#include <lightwell/time.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell::measure {
namespace {

constexpr int kPasses = 5;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_speed: %s\n", s.message().c_str());
  std::exit(1);
}

/// One pass over the buffers; updates the best time of each.
void turn(std::vector<double>& best, const std::function<void(std::size_t)>& once) {
  for (std::size_t i = 0; i < best.size(); ++i) {
    const std::int64_t start = monotonic_now_ns();
    once(i);
    best[i] = std::min(best[i], static_cast<double>(monotonic_now_ns() - start) * 1e-9);
  }
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

SpeedBench::SpeedBench(const sim::Scene& scene, const SpeedCase& c) {
  Result<RigParameters> made_rig = sim::make_rig(c.rig, c.width, c.height, c.format);
  if (!made_rig) fail(made_rig.status());
  RigParameters& rig = *made_rig;
  if (c.linear)
    for (LensParameters& lens : rig.lenses) lens.photometry.response.kind = ResponseCurve::Kind::linear;

  std::vector<std::byte> bracket;
  std::vector<std::size_t> offsets;
  sim::SensorModel model = sim::sensor_of(rig, c.format, 1);
  if (c.linear) model.photometry.response.kind = ResponseCurve::Kind::linear;
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    const std::vector<float> radiance = sim::render_radiance(scene, scene.state_at(0), rig.lenses[k], 2);
    const sim::Sensor sensor(rig.lenses[k], model);
    for (std::size_t e = 0; e < c.exposures.size(); ++e) {
      offsets.push_back(bracket.size());
      bracket.resize(bracket.size() + sensor.bytes());
      sensor.expose(radiance, {c.exposures[e], 1, e, static_cast<int>(k)},
                    std::span(bracket).subspan(offsets.back(), sensor.bytes()));
    }
  }

  buffers_.assign(c.buffers, bracket);
  frames_.resize(c.buffers);
  for (std::size_t i = 0; i < c.buffers; ++i) {
    for (std::size_t e = 0; e < c.exposures.size(); ++e) {
      Frame frame;
      frame.info.sequence = i;
      frame.info.mid_exposure = {static_cast<std::int64_t>(i + 1) * 33'000'000};
      frame.info.delivered = frame.info.mid_exposure;
      frame.info.exposure_s = c.exposures[e];
      for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
        const std::size_t at = offsets[k * c.exposures.size() + e], stride = packed_stride(c.format, c.width);
        frame.add_view({static_cast<int>(k), c.format, c.width, c.height, stride,
                        std::span(buffers_[i]).subspan(at, picture_bytes(c.format, stride, c.height))});
      }
      frames_[i].push_back(std::move(frame));
    }
  }

  PanoramaOptions options;
  options.config = c.config;
  Result<std::unique_ptr<Estimator>> estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  estimator_ = std::move(*estimator);
  shown_.bytes = static_cast<double>(bracket.size());
  seconds_.assign(c.buffers, std::numeric_limits<double>::infinity());
  memcpy_seconds_ = seconds_;
}

void SpeedBench::pass() {
  const std::size_t count = buffers_.size();
  turn(seconds_, [&](std::size_t i) {
    if (const Status s = estimator_->estimate(frames_[i], made_); !s.ok()) fail(s);
    const auto encoded = encoder_.encode(made_);
    if (!encoded) fail(encoded.status());
    shown_.descriptor_bytes = static_cast<double>(encoded->size());
  });
  shown_.lights = static_cast<int>(made_.lights.size());
  // All buffers have the same content, so copying does not change them.
  turn(memcpy_seconds_,
       [&](std::size_t i) { std::memcpy(buffers_[(i + 1) % count].data(), buffers_[i].data(), buffers_[i].size()); });
}

Speed SpeedBench::best() const {
  Speed out = shown_;
  out.seconds = mean(seconds_);
  out.memcpy_seconds = mean(memcpy_seconds_);
  return out;
}

Speed measure_speed(const sim::Scene& scene, const SpeedCase& c) {
  SpeedBench bench(scene, c);
  for (int k = 0; k < kPasses; ++k) bench.pass();
  return bench.best();
}

}  // namespace lightwell::measure
