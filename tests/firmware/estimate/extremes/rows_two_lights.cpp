// Two lamps that approach each other and separate.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <lightwell/query.hpp>

#include "firmware/estimate/extremes/rows.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::extremes {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<reference::Rgb> irradiance_of_answer(const Descriptor& d, const std::vector<reference::V3>& normals) {
  std::vector<reference::Rgb> out;
  for (const reference::V3& n : normals) {
    const Irradiance e = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
    out.push_back({e.r, e.g, e.b});
  }
  return out;
}

double change(const std::vector<reference::Rgb>& before, const std::vector<reference::Rgb>& now) {
  const reference::IrradianceError e = reference::irradiance_error(before, now);
  return std::max(e.rms, e.luminance_weighted);
}

/// Mean luminance over normals.
double energy(const std::vector<reference::Rgb>& irradiance) {
  double sum = 0;
  for (const reference::Rgb& e : irradiance) sum += reference::luminance(e);
  return sum / static_cast<double>(irradiance.size());
}

}  // namespace

TwoLightsRow two_lights(const EstimatorConfig& config, PixelFormat format, double second) {
  TwoLightsRow row;
  const bool codes = format == PixelFormat::rgb8;
  const RigRenderer renderer(rig_of("pair", 320, 240, format));
  const auto estimator = estimator_of(renderer.rig(), config);
  const auto& normals = renderer.truth().normals();
  constexpr double kRadius = 1.5 * kDegree;
  // Codes have a range of two and a half decades: dimmer lamps keep the room above the noise.
  const float level = codes ? 150 : 1000;
  const Pictures even = renderer.render(constant({1, 1, 1}));

  std::set<std::uint32_t> tracks;
  std::map<std::uint32_t, int> lamp_of_track;
  std::vector<reference::Rgb> last_answer, last_truth;
  std::vector<std::pair<std::size_t, int>> choices;
  constexpr int kFrames = 401;
  for (int i = 0; i < kFrames; ++i) {
    const double gap = std::abs(20 - 0.1 * i), half = gap / 2 * kDegree;
    const Vec3d lamps[] = {normalized(Vec3d{std::sin(half), 0.2, -std::cos(half)}),
                           normalized(Vec3d{-std::sin(half), 0.2, -std::cos(half)})};
    Pictures pictures = even;
    renderer.add({lamps[0], kRadius, {level, level, level}}, pictures);
    const auto weaker = static_cast<float>(level * second);
    renderer.add({lamps[1], kRadius, {weaker, weaker, weaker}}, pictures);
    // The sum of both lamps is just below saturation: full scale is a radiance of 0.01 / exposure.
    Shot shot = codes ? renderer.as_rgb8(pictures, 0.9 * 0.01 / (2 * level), static_cast<std::uint64_t>(i))
                      : renderer.as_floats(pictures);
    shot.frame.info.sequence = static_cast<std::uint64_t>(i);
    shot.frame.info.mid_exposure = {1'000'000'000LL + i * 33'333'333LL};
    Descriptor d;
    const std::string where = name_of(config) + (codes ? ", rgb8, " : ", ") + std::to_string(gap) +
                              (i < kFrames / 2 ? " degrees, closing" : " degrees, parting");
    if (!estimator->estimate(std::span(&shot.frame, 1), d).ok()) {
      ++row.tally.refused;
      continue;
    }
    const auto truth = renderer.truth().irradiance(pictures);
    row.tally.count(d, normals, truth, where);

    const auto now = irradiance_of_answer(d, normals);
    if (!last_answer.empty()) {
      const double step = energy(now) / energy(last_answer) - energy(truth) / energy(last_truth);
      row.worst_energy = std::max(row.worst_energy, std::abs(step));
      const double jump = change(last_answer, now) - change(last_truth, truth);
      if (jump > row.worst_jump) row.worst_jump = jump, row.worst_case = where;
    }
    last_answer = now;
    last_truth = truth;

    for (const Light& l : d.lights) {
      tracks.insert(l.track);
      // Assigns separated lights to lamps; closer than a diameter, they are one light.
      if (d.lights.size() != 2 || gap < 2 * kRadius / kDegree + 0.5) continue;
      const Vec3d at = vec_cast<double>(l.direction);
      const int lamp = angle_between(at, lamps[0]) < angle_between(at, lamps[1]) ? 0 : 1;
      const auto known = lamp_of_track.find(l.track);
      if (known != lamp_of_track.end() && known->second != lamp) ++row.swaps;
      lamp_of_track[l.track] = lamp;
    }
    choices.emplace_back(d.lights.size(), d.radiance.band);
  }
  row.tracks = static_cast<int>(tracks.size());
  for (std::size_t i = 1; i < choices.size(); ++i) {
    if (choices[i] == choices[i - 1]) continue;
    ++row.choices;
    for (std::size_t j = i + 1; j < std::min(choices.size(), i + 10); ++j)
      if (choices[j] == choices[i - 1]) {
        ++row.flickers;
        break;
      }
  }
  return row;
}

}  // namespace lightwell::extremes
