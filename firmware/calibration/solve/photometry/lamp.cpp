#include "calibration/solve/photometry/lamp.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

/// The lamp's pixels are those above this fraction of its peak, and a margin around them for the blur of the lens.
constexpr double kMinShareOfPeak = 0.1;
constexpr double kRim = 3;

/// Linear value and solid angle by site.
struct Sites {
  int width = 0, height = 0;
  std::vector<double> light, solid_angle;
  std::vector<bool> saturated;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Box filter of 3 x 3 sites, so that a single noisy site is not taken for a lamp.
std::vector<double> smoothed(const Sites& s) {
  std::vector<double> out(s.light.size());
  for (int y = 1; y + 1 < s.height; ++y)
    for (int x = 1; x + 1 < s.width; ++x) {
      double sum = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) sum += s.light[s.index(x + i, y + j)] / 9;
      out[s.index(x, y)] = s.solid_angle[s.index(x, y)] > 0 ? sum : 0;
    }
  return out;
}

struct Blob {
  double x = 0, y = 0, radius = 0;
};

/// The connected region around `peak` of sites with light of at least `least`.
Blob connected_region(const Sites& s, const std::vector<double>& light, std::size_t peak, double least) {
  std::vector<std::size_t> found{peak};
  std::vector<bool> seen(light.size());
  seen[peak] = true;
  const auto width = static_cast<std::size_t>(s.width);
  double total = 0;
  Blob out;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const std::size_t at = found[k], x = at % width, y = at / width;
    total += s.light[at];
    out.x += s.light[at] * static_cast<double>(x);
    out.y += s.light[at] * static_cast<double>(y);
    const std::size_t next[] = {x > 0 ? at - 1 : at, x + 1 < width ? at + 1 : at, y > 0 ? at - width : at,
                                y + 1 < static_cast<std::size_t>(s.height) ? at + width : at};
    for (const std::size_t n : next) {
      if (seen[n] || light[n] < least) continue;
      seen[n] = true;
      found.push_back(n);
    }
  }
  out.x /= total;
  out.y /= total;
  for (const std::size_t at : found)
    out.radius = std::max(out.radius,
                          std::hypot(static_cast<double>(at % width) - out.x, static_cast<double>(at / width) - out.y));
  return out;
}

}  // namespace

Result<LampFinder> LampFinder::make(const LensParameters& lens) {
  RigParameters rig;  // Only this lens, so that its solid angles are not weighted for an overlap.
  rig.lenses = {lens};
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  LampFinder out;
  out.lens_ = lens;
  out.solid_angle_ = std::move(table->lenses.front().solid_angle);
  return out;
}

Result<LampObservation> LampFinder::find(const Picture& picture, double exposure, std::optional<double> angle_rad,
                                         const std::string& name) const {
  const auto invalid = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, name + ": " + what);
  };
  const int pitch = picture.pitch;
  if (picture.width * pitch != lens_.width || picture.height * pitch != lens_.height)
    return invalid("it has " + std::to_string(picture.width * pitch) + "x" + std::to_string(picture.height * pitch) +
                   " pixels, the calibration speaks of " + std::to_string(lens_.width) + "x" +
                   std::to_string(lens_.height));
  if (!(exposure > 0) || !std::isfinite(exposure)) return invalid("its exposure must be positive");
  const PhotometricCalibration& p = lens_.photometry;
  Sites sites{picture.width, picture.height, {}, {}, {}};
  std::vector<double> of_field;
  for (int y = 0; y < sites.height; ++y)
    for (int x = 0; x < sites.width; ++x) {
      double sum = 0, solid_angle = 0;
      bool saturated = false;
      for (int c = 0; c < 3; ++c) {
        const double v = static_cast<double>(picture.at(x, y, c));
        sum += (linearized(p.response, v) - p.black_level) / (1 - p.black_level);
        saturated = saturated || v >= p.saturation;
      }
      for (int k = 0; k < pitch * pitch; ++k)
        solid_angle += static_cast<double>(
            solid_angle_[static_cast<std::size_t>(y * pitch + k / pitch) * static_cast<std::size_t>(lens_.width) +
                         static_cast<std::size_t>(x * pitch + k % pitch)]);
      sites.light.push_back(sum);
      sites.solid_angle.push_back(solid_angle);
      sites.saturated.push_back(saturated);
      if (solid_angle > 0) of_field.push_back(sum);
    }
  const double around = median_of(of_field);
  std::vector<double> off = of_field;
  for (double& v : off) v -= around;
  const double noise = std::max(scale_about_zero(off), 3 * rounding_deviation(picture.levels));
  const std::vector<double> light = smoothed(sites);
  const auto peak = static_cast<std::size_t>(std::max_element(light.begin(), light.end()) - light.begin());
  if (!(light[peak] > around + 20 * noise && light[peak] > 0.05))
    return invalid("no lamp stands out; darken the room, or use a longer exposure");

  const Blob blob = connected_region(sites, light, peak, around + kMinShareOfPeak * (light[peak] - around));
  const double inner = blob.radius + kRim / pitch, outer = 1.5 * inner + kRim;
  const int across = std::min(sites.width, sites.height);
  if (2 * blob.radius > across / 10.0)
    return invalid("the lamp is " + std::to_string(static_cast<int>(2 * blob.radius)) +
                   " pixels wide; take a smaller one or go further away, to less than a tenth of the picture");
  std::vector<double> ring;
  double sum = 0, area = 0, variance = 0;
  std::vector<std::pair<double, double>> inside;  // light, solid angle
  for (int y = static_cast<int>(std::floor(blob.y - outer)); y <= static_cast<int>(std::ceil(blob.y + outer)); ++y)
    for (int x = static_cast<int>(std::floor(blob.x - outer)); x <= static_cast<int>(std::ceil(blob.x + outer)); ++x) {
      const double distance = std::hypot(x - blob.x, y - blob.y);
      if (distance > outer) continue;
      const bool there =
          x >= 0 && y >= 0 && x < sites.width && y < sites.height && sites.solid_angle[sites.index(x, y)] > 0;
      if (!there && distance <= inner)
        return invalid("the lamp is cut by the edge of the picture or of the field of view; remove this picture");
      if (!there) continue;
      const std::size_t k = sites.index(x, y);
      if (distance > inner) {
        ring.push_back(sites.light[k]);
        continue;
      }
      if (sites.saturated[k]) return invalid("the lamp is saturated; take all pictures with a shorter exposure");
      sum += sites.light[k] * sites.solid_angle[k];
      area += sites.solid_angle[k];
      variance += sites.solid_angle[k] * sites.solid_angle[k] *
                  (3 * p.read_noise * p.read_noise + p.shot_noise * std::max(0.0, sites.light[k]));
    }
  const double background = median_of(ring);
  LampObservation out;
  out.value = (sum - background * area) / exposure;
  out.deviation = std::sqrt(variance) / exposure;
  if (!(out.value > 0)) return invalid("no light is left of the lamp above its surroundings; darken the room");
  if (angle_rad) {
    out.angle_rad = *angle_rad;
    return out;
  }
  const auto direction =
      CameraModel(lens_).unproject({pitch * blob.x + (pitch - 1) / 2.0, pitch * blob.y + (pitch - 1) / 2.0});
  if (!direction) return invalid("the lamp is outside the field of view; remove this picture");
  out.angle_rad = std::atan2(std::hypot(direction->x, direction->y), direction->z);
  return out;
}

}  // namespace lightwell::photometry
