#include "measure/shots.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <lightwell/codec.hpp>

#include "sim/sensor.hpp"

namespace lightwell::measure {
namespace {

constexpr std::uint64_t kHourOfCaptures = 30 * 3600;
constexpr std::int64_t kDeliveredAfterNs = 25'000'000;

}  // namespace

Camera::Camera(const RigParameters& rig, PixelFormat format) : rig_(rig), format_(format) {
  for (const LensParameters& lens : rig_.lenses) sensors_.emplace_back(lens, sim::sensor_of(rig_, format_, 1));
}

LensRadiance Camera::render(const sim::Scene& scene, const sim::SceneState& state) {
  const int samples = sim::samples_for(rig_.lenses.front(), scene.panorama(state));
  if (samples != samples_) {
    rays_.clear();
    for (const LensParameters& lens : rig_.lenses) rays_.emplace_back(lens, samples);
    samples_ = samples;
  }
  LensRadiance out;
  for (const sim::LensRays& rays : rays_) {
    std::vector<float>& picture =
        out.emplace_back(3 * static_cast<std::size_t>(rays.width()) * static_cast<std::size_t>(rays.height()));
    rays.render(scene, state, {0, rays.height()}, picture);
  }
  return out;
}

std::vector<double> Camera::bracket_of_three(double peak, double mean) const {
  if (format_ == PixelFormat::rgb_f32) return {1};
  const sim::SensorModel model = sim::sensor_of(rig_, format_, 1);
  const double shortest = sim::exposure_below_saturation(model, peak, 1);
  const double longest = std::max(sim::exposure_below_saturation(model, 2 * mean, 1), 4 * shortest);
  return {shortest, std::sqrt(shortest * longest), longest};
}

Shot Camera::expose(const LensRadiance& radiance, std::span<const double> exposures, std::uint64_t capture) const {
  std::vector<std::vector<std::byte>> pixels;
  const std::uint64_t first = (kHourOfCaptures + capture) * exposures.size();
  for (std::size_t e = 0; e < exposures.size(); ++e)
    for (std::size_t k = 0; k < sensors_.size(); ++k) {
      pixels.emplace_back(sensors_[k].bytes());
      sensors_[k].expose(radiance[k], {exposures[e], 1, first + e, static_cast<int>(k)}, pixels.back());
    }
  return exposed(std::move(pixels), exposures, capture);
}

Shot Camera::exposed(std::vector<std::vector<std::byte>> pixels, std::span<const double> exposures,
                     std::uint64_t capture) const {
  Shot out{std::move(pixels), {}};
  const std::uint64_t number = kHourOfCaptures + capture;
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame frame;
    frame.info.sequence = number * exposures.size() + e;
    frame.info.mid_exposure = {static_cast<std::int64_t>(number) * 1'000'000'000 / 30};
    frame.info.delivered = frame.info.mid_exposure + Duration{kDeliveredAfterNs};
    frame.info.exposure_s = exposures[e];
    frame.info.bracket_index = static_cast<int>(e);
    frame.info.bracket_size = static_cast<int>(exposures.size());
    for (std::size_t k = 0; k < sensors_.size(); ++k)
      frame.add_view({static_cast<int>(k), format_, rig_.lenses[k].width, rig_.lenses[k].height, sensors_[k].stride(),
                      out.pixels[e * sensors_.size() + k]});
    out.frames.push_back(std::move(frame));
  }
  return out;
}

double peak_of(std::span<const float> rgb) {
  return rgb.empty() ? 0 : static_cast<double>(*std::max_element(rgb.begin(), rgb.end()));
}

double peak_of(const LensRadiance& radiance) {
  double peak = 0;
  for (const std::vector<float>& lens : radiance) peak = std::max(peak, peak_of(lens));
  return peak;
}

double mean_of(const LensRadiance& radiance) {
  double sum = 0, seen = 0;
  for (const std::vector<float>& lens : radiance) {
    for (std::size_t i = 0; i < lens.size(); i += 3) {
      const double l = 0.2126 * lens[i] + 0.7152 * lens[i + 1] + 0.0722 * lens[i + 2];
      sum += l;
      seen += l > 0 ? 1 : 0;
    }
  }
  return sum / std::max(seen, 1.0);
}

Result<Delivered> deliver(Estimator& estimator, const Shot& shot) {
  Descriptor made;
  if (const Status s = estimator.estimate(shot.frames, made); !s.ok()) return s;
  made.time.encoded_after = Duration{30'000'000};
  Encoder encoder;
  const auto bytes = encoder.encode(made);
  if (!bytes) return bytes.status();
  Result<Descriptor> back = decode_descriptor(*bytes);
  if (!back) return back.status();
  return Delivered{std::move(*back), bytes->size()};
}

}  // namespace lightwell::measure
